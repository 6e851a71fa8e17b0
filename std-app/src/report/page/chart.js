// Curves of error against time on logarithmic axes. Colours come from the style sheet.

const STYLES = 6;

// Classes of the style sheet for a curve: a colour, and dots for the second use of it.
const styleOf = (index) => `s${index % STYLES}${index < STYLES ? "" : " again"}`;

// Points closer than this in the logarithm of time merge; with few points each has a mark.
const MIN_DISTANCE = 0.004;
const MAX_MARKS = 40;

const MARGIN = { left: 74, right: 14, top: 12, bottom: 46 };

const isPositive = (value) => value > 0 && Number.isFinite(value);

// Logarithmic axis from `low` to `high`.
class Axis {
  constructor(low, high) {
    Object.assign(this, { low, high });
  }

  // Axis from the last of 1, 2, 5 × 10ⁿ below the positive values to the first above.
  static around(values) {
    const [low, high] = Axis.ends(values);
    if (!(low <= high)) return null;
    const rounds = [];
    for (let decade = Math.floor(Math.log10(low)); decade <= Math.ceil(Math.log10(high)); decade++) {
      rounds.push(...[1, 2, 5, 10].map((digit) => digit * 10 ** decade));
    }
    const first = rounds.filter((round) => round <= low * (1 + 1e-9)).at(-1);
    return new Axis(first, rounds.find((round) => round >= high * (1 - 1e-9) && round > first * (1 + 1e-9)));
  }

  // Axis from slightly below the positive values to slightly above.
  static close(values) {
    const [low, high] = Axis.ends(values);
    const margin = Math.max(1.1, (high / low) ** 0.02);
    return low <= high ? new Axis(low / margin, high * margin) : null;
  }

  static ends(values) {
    const positive = values.filter(isPositive);
    return [positive.reduce((a, b) => Math.min(a, b), Infinity), positive.reduce((a, b) => Math.max(a, b), 0)];
  }

  // Position of a value, from 0 at the low end to 1.
  position(value) {
    return Math.log(value / this.low) / Math.log(this.high / this.low);
  }

  // Values of the grid, and whether each has a label: decades; 2 and 5 on short axes; all digits in a decade.
  ticks() {
    const decades = Math.log10(this.high / this.low);
    const step = Math.max(1, Math.ceil(decades / 8));
    const digits = [1, 2, 3, 4, 5, 6, 7, 8, 9].filter((digit) => [1, 2, 5].includes(digit) || decades < 0.8);
    const ticks = [];
    for (let decade = Math.floor(Math.log10(this.low)); decade <= Math.ceil(Math.log10(this.high)); decade++) {
      for (const digit of digits) {
        const [value, labelled] = [digit * 10 ** decade, digit === 1 ? decade % step === 0 : decades < 2.3];
        const inside = value >= this.low * (1 - 1e-9) && value <= this.high * (1 + 1e-9);
        if (inside && (labelled || decades < 5)) ticks.push([value, labelled]);
      }
    }
    return ticks;
  }
}

// Shortest label of a value of the grid.
const tickLabel = (value) => {
  const decade = Math.floor(Math.log10(value) + 1e-9);
  const digit = Math.round(value / 10 ** decade);
  if (decade >= 0 && decade <= 3) return value.toFixed(0);
  if (decade >= -2 && decade < 0) return value.toFixed(-decade);
  return digit === 1 ? powerOfTen(decade) : `${digit}×${powerOfTen(decade)}`;
};

// Points at visible distances, and the last one.
const thinned = (points) => {
  const kept = [];
  points.forEach((point, index) => {
    const last = kept.at(-1);
    const isFar = last === undefined || point[0] >= last[0] * (1 + MIN_DISTANCE);
    if (isFar || index === points.length - 1) kept.push(point);
  });
  return kept;
};

// Curve number `index` of `points` [seconds, error], with a `band` [seconds, lower, upper] and a fitted power law.
const series = (name, index, points, band = [], fit = null) => ({
  name, fit, style: styleOf(index),
  points: points.filter(([seconds, error]) => isPositive(seconds) && isPositive(error)),
  band: band.filter(([seconds]) => isPositive(seconds)),
});

const errorAt = (fit, seconds) => Math.exp(fit.level + fit.slope * Math.log(seconds));

// Chart as wide as its element; empty without curves. Leads, [{from, to, style, name}], are a strip at the axis.
const chart = (all, leads = []) => {
  const drawn = all.filter((one) => one.points.length > 0);
  const points = drawn.flatMap((one) => one.points);
  // Intervals far below the curve would flatten it.
  const lowest = points.reduce((least, point) => Math.min(least, point[1]), Infinity);
  const ends = drawn.flatMap((one) => one.band).flatMap(([, lower, upper]) => [Math.max(lower, lowest / 2), upper]);
  const axes = [Axis.close(points.map(([seconds]) => seconds)), Axis.around([...points.map((p) => p[1]), ...ends])];
  if (axes.includes(null)) return null;
  const figure = el("div", { class: "chart" }, legend(drawn), el("div", { class: "plot" }));
  const plot = figure.lastChild;
  new ResizeObserver(() => {
    const width = Math.round(plot.clientWidth);
    if (width > 0 && plot.dataset.width !== String(width)) {
      plot.dataset.width = width;
      plot.replaceChildren(drawing(drawn, leads, axes, width, Math.round(300 + width / 8)));
    }
  }).observe(plot);
  return figure;
};

const legend = (drawn) => {
  const entry = (sample, name) =>
    el("li", {}, svg("svg", { viewBox: "0 0 28 8", "aria-hidden": "true" }, sample), name);
  const line = (style) => svg("path", { class: style, d: "M0 4H28" });
  return el("ul", { class: "legend" },
    drawn.map((one) => entry(line(`curve ${one.style}`), one.name)),
    drawn.some((one) => one.band.length > 0)
      && entry(svg("rect", { class: "band s0", width: 28, height: 8 }), `95${THIN}% interval`),
    drawn.some((one) => one.fit) && entry(line("fit"), "fitted line"));
};

const drawing = (drawn, leads, [xAxis, yAxis], width, height) => {
  const { left, right, top, bottom } = MARGIN;
  const [end, floor] = [width - right, height - bottom];
  const x = (seconds) => left + xAxis.position(seconds) * (end - left);
  const y = (error) => floor - yAxis.position(Math.max(error, yAxis.low)) * (floor - top);
  const path = (points) => points.map(([t, e], i) => `${i ? "L" : "M"}${x(t).toFixed(1)} ${y(e).toFixed(1)}`).join("");
  const line = (labelled, d) => svg("path", { class: labelled ? "grid" : "grid minor", d });
  const label = (name, px, py, text) => svg("text", { class: name, x: px, y: py }, text);
  const curve = ({ name, style, points, band, fit }) => {
    const [few, wide] = [thinned(points), thinned(band)];
    const area = [...wide.map(([t, , upper]) => [t, upper]), ...wide.map(([t, lower]) => [t, lower]).reverse()];
    const fitted = fit && [Math.max(few[0][0], fit.from), few.at(-1)[0]].map((t) => [t, errorAt(fit, t)]);
    const mark = ([t, e]) =>
      svg("circle", { class: style, cx: x(t).toFixed(1), cy: y(e).toFixed(1), r: 3 },
        svg("title", {}, `${name}: ${number(e)} after ${duration(t)}`));
    return [
      wide.length > 1 && svg("path", { class: `band ${style}`, d: path(area) + "Z" }),
      fitted && svg("path", { class: "fit", d: path(fitted) }),
      svg("path", { class: `curve ${style}`, d: path(few) }),
      few.length <= MAX_MARKS && few.map(mark),
    ].flat();
  };
  return svg("svg", { width, height, role: "img", "aria-label": "relMSE against seconds of rendering, logarithmic" },
    xAxis.ticks().map(([t, labelled]) => [
      line(labelled, `M${x(t).toFixed(1)} ${top}V${floor}`),
      labelled && label("below", x(t), floor + 18, tickLabel(t)),
    ]).flat(),
    yAxis.ticks().map(([e, labelled]) => [
      line(labelled, `M${left} ${y(e).toFixed(1)}H${end}`),
      labelled && label("beside", left - 8, y(e) + 4.5, tickLabel(e)),
    ]).flat(),
    label("below", (left + end) / 2, height - 6, "seconds of rendering"),
    svg("text", { class: "below", transform: `translate(10 ${(top + floor) / 2}) rotate(-90)` }, "relMSE"),
    drawn.map(curve).flat(),
    leads.map(({ from, to, style, name }) =>
      svg("rect", { class: `lead ${style}`, x: x(from), y: floor - 7, width: Math.max(0, x(to) - x(from)), height: 7 },
        svg("title", {}, name))));
};
