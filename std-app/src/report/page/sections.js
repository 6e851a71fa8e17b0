// Sections of the page: sentences, facts and tables of the object of `run.json`.

// Ratio of the ends above which an interval is called uncertain.
const UNCERTAIN = 10;

// Longest predicted time, as a multiple of the rendering time.
const MAX_PREDICTION = 1000;

// Rows of the tables of rounds, and of tiles with dropped samples.
const MAX_ROWS = 40;
const MAX_TILES = 12;

// Causes of dropped samples, and their number.
const CAUSES = { nan: "not a number", infinite: "infinite", negative: "negative", unfinished: "unfinished" };
const lost = (counts) => Object.keys(CAUSES).reduce((sum, cause) => sum + counts[cause], 0);

const ENDINGS = {
  interrupted: " The render was stopped early.",
  biased: " The render stopped because the bias alone exceeds the requested error: more samples do not help, another method may.",
  "noise-floor": " The render stopped because noise that all samples share exceeds the requested error: more samples do not help.",
};

const strong = (text) => el("strong", {}, text);

const interval = (error) => [strong(number(error.relmse)), ` (95${THIN}%: ${range(error.interval)})`];

// First sentences of a render.
const lead = ({ error, ending }) => {
  const typical = (relmse) =>
    relmse == null ? "" : `: a typical pixel is off by ${number(100 * Math.sqrt(relmse), 2)}${THIN}%`;
  const source = error.bias ? "noise and audit" : error.blur ? "noise and blur of photons" : "noise";
  const sentence = () => {
    if (error.against === "reference") {
      const estimate = error.estimate.relmse === null ? ["unknown"] : interval(error.estimate);
      return ["This picture has a relMSE of ", strong(number(error.relmse)), " against the reference",
        typical(error.relmse), `. The estimate from its ${source} is `, ...estimate, "."];
    }
    if (error.relmse === null) {
      return ["The error of this picture is unknown: the estimate needs four samples per pixel and some light."];
    }
    if (error.interval[1] > UNCERTAIN * error.interval[0]) {
      return ["The relMSE of this picture is uncertain: the estimate is ", strong(number(error.relmse, 2)),
        `, the 95${THIN}% interval ${range(error.interval)}. A few very bright samples dominate the error.`];
    }
    return ["This picture has a relMSE of about ", ...interval(error), `, estimated from its ${source}`,
      typical(error.relmse), "."];
  };
  return [...sentence(), ENDINGS[ending] ?? ""];
};

// Curve of the estimates of a render, and of its errors against the reference.
const estimates = (run, name, index, fit) => series(name, index,
  run.history.map((round) => [round.seconds, round.relmse]),
  run.history.filter((round) => isPositive(round.relmse)).map((round) => [round.seconds, ...round.interval]), fit);

const measurements = (run, name, index, fit) =>
  series(name, index, run.history.map((round) => [round.seconds, round.reference?.relmse]), [], fit);

const hasReference = (run) => run.error.against === "reference";

// Slopes of the curves, and the time to the next power of ten.
const slopes = (curves) => {
  const fitted = curves.filter((curve) => curve.fit);
  if (fitted.length === 0) return ["A fit needs five rounds."];
  const hundredths = (value) => value.toFixed(2).replace("-", "−");
  const time = (seconds) => duration(seconds).replaceAll(" ", "\u00a0");
  // The curve against the reference, the last one, is the better one.
  const { fit, points } = fitted.at(-1);
  const slope = ({ fit, name }, index) => [index > 0 ? ", " : "", strong(hundredths(fit.slope)),
    ` (95${THIN}%: ${hundredths(fit.interval[0])} to ${hundredths(fit.interval[1])}) `,
    name === "estimate" ? "estimated" : name];
  const [now, error] = points.at(-1);
  const goal = 10 ** Math.floor(Math.log10(0.99 * error));
  const seconds = fit.slope < 0 ? Math.exp((Math.log(goal) - fit.level) / fit.slope) : Infinity;
  const isKnown = fit.interval[1] < 0 && seconds >= now && seconds < now * MAX_PREDICTION;
  return [`From ${time(fit.from)} on, the error falls as a power of time: `, ...fitted.flatMap(slope),
    ". Independent samples give −1.", isKnown ? ` At this rate a relMSE of ${number(goal, 1)} takes ${time(seconds)}.` : ""];
};

// Table of rounds, spread evenly over the logarithm of time.
const rounds = (run) => {
  const { history } = run;
  const growth = (history.at(-1).seconds / history[0].seconds) ** (1 / MAX_ROWS);
  let last = 0;
  const kept = history.filter((round, index) => {
    const isKept = history.length <= MAX_ROWS || round.seconds >= last * growth || index + 1 === history.length;
    if (isKept) last = round.seconds;
    return isKept;
  });
  const against = hasReference(run) ? ["relMSE", "FLIP"] : [];
  const row = (round) => [duration(round.seconds), grouped(round.spp), grouped(round.rays), orDash(round.relmse),
    orDash(round.interval, range),
    ...(hasReference(run) ? [orDash(round.reference?.relmse), orDash(round.reference?.flip)] : [])];
  const head = ["time", "samples per pixel", "rays", "relMSE, estimated", `95${THIN}% interval`, ...against];
  return [table("Rounds", head, kept.map(row), false),
    kept.length < history.length
      ? el("p", {}, `${kept.length} of ${history.length} rounds; all rounds are in `, el("code", {}, "curve.csv"), ".")
      : ""];
};

const deviation = ({ mean, error }) => `${signedPercent(mean)} ± ${percent(error)}`;

const verdict = (bias) => {
  if (bias.doubt && bias.audit.blind) return [`No verdict: ${bias.doubt}. The error is that of the noise.`];
  if (!bias.found) {
    return [`No bias was found. A relMSE below ${number(bias.detectable, 1)} may remain undetected.`];
  }
  const biased = bias.regions.filter((region) => region.found);
  const worst = biased.reduce((a, b) => (a && Math.abs(a.mean) > Math.abs(b.mean) ? a : b), null);
  const where = () => {
    if (worst) return `: ${biased.length} of ${bias.regions.length} regions, the worst by ${deviation(worst)}.`;
    return bias.deviation.found ? `: by ${deviation(bias.deviation)} as a whole.` : ", but in no single region significantly.";
  };
  return [strong("This picture is biased"), where(), bias.doubt ? ` This is uncertain: ${bias.doubt}.` : ""];
};

const audit = ({ error: { bias, noise } }) => {
  if (!bias) return;
  show("#audit");
  find("#verdict").append(...verdict(bias));
  find("#audit dl").append(...facts([
    ["Bias, as relMSE", number(Math.max(0, bias.relmse), 2)],
    [`Upper bound, 95${THIN}%`, number(bias.interval[1], 2)],
    ["Noise, as relMSE", number(noise.relmse, 2)],
    ["Deviation of the whole picture", deviation(bias.deviation)],
    ["Time of the audit", duration(bias.audit.seconds)],
  ]));
  find("#audited").append(`Unbiased path tracing renders ${plural(bias.audit.pixels, "pixel")} with `
    + `${plural(bias.audit.samples, "sample")} each, in step with the picture.`);
};

// Note under the maps of the error.
const mapsNote = ({ samples: [least, most], error }) => {
  const counts = () => {
    if (least === most) return `Every pixel has ${plural(least, "sample")}. `;
    return most === least + 1 ? `Every pixel has ${least} or ${most} samples: the time ended within a round. ` : "";
  };
  const isUnknown = (error.estimate ?? error).relmse === null;
  return counts() + (isUnknown ? "An error estimate needs four samples."
    : "Errors are estimated from the halves of each pixel and averaged over a few pixels. Scales are logarithmic and "
      + `leave out the lowest 1${THIN}% and the highest 0.5${THIN}% of the pixels.`);
};

// Value of a finding, whose unit follows from its name.
const findingText = (topic, name, value) => {
  if (value instanceof Object) {
    const { error, rays_per_sample: work, reason } = value;
    return error === null ? `no choice: ${reason}` : `relMSE ${number(error)}, ${number(work)} rays a sample: ${reason}`;
  }
  if (typeof value !== "number") return String(value);
  if (name === "seconds") return duration(value);
  const isFraction = /^(share|useful|accepted|covered|predicted|achieved|rms)/.test(name);
  if (isFraction || (topic === "cache_survey" && name === "noise")) return percent(value);
  return Number.isInteger(value) ? grouped(value) : number(value);
};

const finding = ([topic, { decision, reason, ...values }]) => [
  el("h3", {}, `${words(topic)}: ${decision}`),
  reason === "" ? "" : el("p", {}, `${reason}.`),
  el("dl", { class: "facts row" },
    facts(Object.entries(values).map(([name, value]) => [words(name), findingText(topic, name, value)]))),
];

const resources = ({ seconds, memory, memory_peak: peak }) => {
  const rest = Math.max(0, seconds.total - seconds.load - seconds.build - seconds.render);
  const time = [["loading", seconds.load], ["building", seconds.build], ["rendering", seconds.render],
    ["comparing, saving and the rest", rest]];
  show("#resources");
  find("#resources .columns").append(bars("Time", time, duration),
    bars("Memory", [...Object.entries(memory), ["at the peak", peak]], byteCount));
};

const scene = (run) => {
  const contents = Object.entries(run.census).filter(([, count]) => count > 0);
  const techniques = ["light_paths", "connections", "merging"];
  const features = run.left_out.filter(({ what }) => !techniques.includes(what));
  const unused = features.map(({ what, why }) => [words(what), why]);
  find("#scene .columns").append(pairs("Contents", contents.map(([name, count]) => [words(name), grouped(count)])),
    unused.length > 0 ? pairs("Not needed", unused) : "");
  if (run.repairs.length > 0) {
    show("#repairs");
    find("#repairs ul").append(...run.repairs.map((repair) => el("li", {}, repair)));
  }
};

// Rejected samples of a render: numbers, causes and tiles.
const dropped = ({ dropped: { places, tiles, empty_pixels: empty, ...causes }, paths }) => {
  const total = lost(causes);
  if (total === 0) return [el("p", {}, `None of ${grouped(paths)} samples was dropped.`)];
  const row = ([cause, name]) => [name, grouped(causes[cause]), percent(causes[cause] / Math.max(1, paths))];
  const tile = (place) => [
    `columns ${place.x} to ${place.x + place.width - 1}, rows ${place.y} to ${place.y + place.height - 1}`,
    grouped(lost(place)),
  ];
  const shown = places.slice(0, MAX_TILES);
  return [
    el("p", {}, `${grouped(total)} of ${grouped(paths)} samples were dropped. Unfinished paths were cut at a technical `
      + "limit, and the picture has their light up to there. Other dropped samples do not count.",
    empty > 0 ? ` ${plural(empty, "pixel")} without any sample left: black.` : ""),
    table("Dropped samples", ["cause", "samples", "of all"], Object.entries(CAUSES).map(row)),
    el("h3", {}, "Tiles with dropped samples",
      shown.length < tiles ? `, the worst ${MAX_TILES} of ${grouped(tiles)}` : ""),
    table("Tiles with dropped samples", ["tile of the picture", "samples"], shown.map(tile)),
  ];
};

const made = (run, { command, version, machine, processors, date }) => {
  find("#made code").textContent = shell(command);
  find("#made dl").append(...facts([
    ["Method", `${run.method}, compiled for: ${run.features}`],
    ["Size", `${run.width} × ${run.height} pixels`],
    ["Longest path", run.max_depth === null ? "no limit" : plural(run.max_depth, "segment")],
    ["Seed", String(run.seed)],
    ["Threads", `${run.threads} of ${processors}`],
    ["Instruction set", run.level],
    ["Machine", machine],
    ["Program", version],
    ["Date", date],
  ]));
};

// Page of one render.
const renderPage = (run, viewer) => {
  find("#heading").textContent = run.scene;
  find("#lead").append(...lead(run));
  find("#facts").append(...facts([
    ["Samples per pixel", grouped(run.spp)],
    ["Rendering", duration(run.seconds.render)],
    ["Error estimation", duration(run.seconds.estimate)],
    ["Rays per second", `${number((run.rays / Math.max(1e-9, run.seconds.render)) * 1e-6, 2)} million`],
    ["Peak memory", byteCount(run.memory_peak)],
    ["Dropped samples", grouped(lost(run.dropped))],
  ]));
  const curves = [estimates(run, "estimate", 0, run.fit.estimate),
    ...(hasReference(run) ? [measurements(run, "against the reference", 1, run.fit.reference)] : [])];
  const drawn = curves.filter((curve) => curve.points.length > 0);
  find("#slopes").append(...slopes(drawn));
  find("#chart").append(chart(drawn) ?? "");
  if (run.history.length > 0) show("#rounds").lastElementChild.append(...rounds(run));
  audit(run);
  if (hasReference(run)) {
    const { relmse, rmse, flip, mean, reference_mean: reference } = run.error;
    show("#comparison");
    find("#comparison dl").append(...facts([["relMSE", number(relmse)], ["RMSE", number(rmse)], ["FLIP", number(flip)],
      ["Mean, against the reference", mean === null ? "unknown" : signedPercent(mean / reference - 1)]]));
  }
  const keys = Object.keys(viewer.pictures[0].layers);
  const sections = {
    comparison: ["difference", "flip"],
    maps: ["standard", "relative", "variance", "bias", "samples"],
    survey: ["records", "radii", "predicted", "achieved"],
    photons: keys.filter((key) => key.includes("photon")),
  };
  for (const [section, those] of Object.entries(sections)) {
    const figures = viewer.figuresOf(those);
    if (figures.length > 0) show(`#${section}`);
    find(`#${section} .maps`).append(...figures);
  }
  show("#maps");
  find("#maps .note").textContent = mapsNote(run);
  const found = Object.entries(run.findings);
  if (found.length > 0) show("#findings").lastElementChild.append(...found.flatMap(finding));
  find("#points").textContent = plural(run.findings.cache_survey?.points ?? 0, "point");
  resources(run);
  find("#dropped div").append(...dropped(run));
};

// Sentence about the best method of a race.
const raceLead = ({ methods, time, leads }) => {
  const after = ` after ${duration(time)} of rendering each.`;
  const known = methods.filter((method) => method.efficiency !== null);
  if (known.length === 0) return [`The error of every picture is unknown,${after}`];
  const best = known.reduce((a, b) => (b.efficiency >= a.efficiency ? b : a));
  const isOpen = (leads.at(-1)?.name ?? null) === null;
  if (methods.length === 1) return [strong(best.name), ` is the only method,${after}`];
  if (isOpen) return ["The intervals of the best methods overlap: ", strong("no clear winner"), `,${after}`];
  const over = best === methods[0] ? "" : `, ${number(best.ratio)} times that of ${methods[0].name}`;
  return [strong(best.name), ` has the highest efficiency${over},${after}`];
};

const raceTable = ({ methods, against }) => {
  const isMeasured = against === "reference";
  const ends = isMeasured ? [] : [`95${THIN}% interval`];
  const row = (method) => [method.name, grouped(method.spp), duration(method.seconds.render),
    orDash(method.error.relmse), ...(isMeasured ? [] : [orDash(method.error.interval, range)]), orDash(method.efficiency), orDash(method.ratio),
    ...(isMeasured ? [] : [orDash(method.ratio_interval, range)])];
  const head = ["method", "samples per pixel", "time", "relMSE", ...ends, "efficiency", "over the first", ...ends];
  return table("Results", head, methods.map(row));
};

// Page of a race.
const racePage = (race, viewer) => {
  const { methods, against, leads } = race;
  find("#heading").textContent = `${methods[0].scene}: a race of ${plural(methods.length, "method")}`;
  find("#lead").append(...raceLead(race));
  show("#results");
  find("#against").textContent = against === "reference" ? "Errors are measured against the reference."
    : `Errors are estimated, with 95${THIN}% intervals. The estimate covers sampled noise and the blur of photons, but no other bias.`;
  find("#table").append(raceTable(race));
  const curve = against === "reference" ? measurements : estimates;
  const style = (name) => (name === null ? "open" : styleOf(methods.findIndex((method) => method.name === name)));
  const named = leads.map((one) => ({ ...one, style: style(one.name), name: one.name ?? "no clear leader" }));
  find("#chart").append(chart(methods.map((method, index) => curve(method, method.name, index)), named) ?? "");
  if (named.length > 0) {
    show("#leads-note");
    show("#leads", el("h3", {}, "Leaders"), el("ol", { class: "leads" },
      named.map(({ from, to, name }) => el("li", {}, `${duration(from)} to ${duration(to)}: ${name}`))));
  }
  show("#grid");
  find("#grid .maps").append(...methods.map((method, of) =>
    viewer.figure(() => viewer.layer(of), (layer) => [method.name,
      `${layer.key === "picture" ? "" : `${layer.title}. `}${grouped(method.spp)} samples per pixel by ${method.method}`])));
  find("#dropped div").append(...methods.flatMap((method) => [el("h3", {}, method.name), ...dropped(method)]));
};

const main = async () => {
  const object = JSON.parse(find("#object").textContent);
  const raws = JSON.parse(find("#layers").textContent);
  const runs = object.methods ?? [object];
  const [first] = runs;
  await Promise.all(raws.map(async (raw) => { raw.values = await decode(raw); }));
  const reference = raws.find((raw) => raw.of === null);
  const pictures = runs.map((run, of) => ({
    name: run.name ?? "picture", layers: layersOf(run, raws.filter((raw) => raw.of === of), reference),
  }));
  for (const key of Object.keys(MAPS)) {
    const group = { layers: pictures.map(({ layers }) => layers[key]).filter((layer) => layer !== undefined) };
    group.layers.forEach((layer) => { layer.group = group; });
  }
  if (reference) {
    const picture = new Layer(reference, { key: "picture", title: "Picture" });
    pictures.push({ name: "reference", layers: { picture } });
  }
  const viewer = new Viewer(pictures, first.width, first.height);
  const layout = first.width > 1.4 * first.height ? "wide" : "tall";
  find("#viewer").classList.add(layout);
  document.body.classList.toggle("single", pictures.length < 2);
  (object.methods ? racePage : renderPage)(object, viewer);
  scene(first);
  made(first, object.made);
  const { picture } = pictures[0].layers;
  const reduction = Math.round(picture.covers[0] / picture.width);
  if (reduction > 1) find("#units").append(` Shown at 1/${reduction} of its size.`);
  document.title = `${find("#heading").textContent} – halflight`;
  document.documentElement.dataset.ready = "true";
};

main().catch((error) => {
  find("#lead").textContent = `This browser cannot show the report (${error.message}). All numbers are in run.json.`;
  throw error;
});
