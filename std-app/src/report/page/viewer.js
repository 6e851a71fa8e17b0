// Viewer: pictures and maps in linked views, their exposure, and the values at the pointer.

// Fraction of the pixels that an exposure may show darker than `BRIGHT`, a linear value. Pictures whose pixels
// are already between the ends of `VISIBLE` there keep the exposure of their PNG.
const DARKER = 0.9;
const BRIGHT = 0.6;
const VISIBLE = [0.15, 1.5];

const EXPOSURE_STEP = 0.25;

// Stops by which the exposure that is chosen can be changed, at least.
const EXPOSURE_RANGE = 8;

// Exposure in stops at which a picture can be seen.
const seenExposure = ({ values }) => {
  const step = 3 * Math.ceil(values.length / 3e5);
  const bright = [];
  for (let i = 0; i < values.length; i += step) {
    const value = (values[i] + values[i + 1] + values[i + 2]) / 3;
    if (isPositive(value)) bright.push(value);
  }
  if (bright.length === 0) return 0;
  const value = quantile(Float32Array.from(bright).sort(), DARKER);
  if (value >= VISIBLE[0] && value <= VISIBLE[1]) return 0;
  return Math.round(Math.log2(BRIGHT / value) / EXPOSURE_STEP) * EXPOSURE_STEP;
};

const stopsText = (stops) =>
  `${stops > 0 ? "+" : ""}${String(stops).replace("-", "−")} ${Math.abs(stops) === 1 ? "stop" : "stops"}`;

// Bar of a colour scale with its labels.
const scaleBar = (range, layer) => {
  const colours = range.stops.map((stop) => `rgb(${stop.join(" ")})`).join(",");
  const bar = el("div", { class: "scale" }, range.labels.map((value) => el("span", {}, layer.label(value))));
  bar.style.setProperty("--colours", colours);
  return bar;
};

const NOTHING = "Zero or unknown everywhere.";

class Viewer {
  // Pictures are [{name, layers}]: one for each method, then the reference, if there is one.
  constructor(pictures, width, height) {
    this.pictures = pictures;
    this.camera = new Camera(width, height);
    this.figures = [];
    const before = Math.min(1, pictures.length - 1);
    this.state = { of: 0, before, key: "picture", other: null, boundary: 50, stops: 0 };
    this.automatic = seenExposure(pictures[0].layers.picture);
    this.stage = new View(this.camera, "Picture", true);
    this.over = this.stage.pane();
    this.over.element.classList.add("over");
    this.divider = el("div", { class: "divider", hidden: "" });
    this.labels = ["left", "right"].map((side) => el("span", { class: `chip ${side}` }));
    this.stage.box.append(this.divider, ...this.labels);
    find("#stage").prepend(this.stage.box);
    this.stage.box.style.setProperty("--aspect", width / height);
    this.choices();
    this.sliders();
    this.keys();
    this.camera.addEventListener("change", () => this.read());
    this.set({ stops: this.automatic });
  }

  layer(of, key = this.state.key) {
    const { layers } = this.pictures[of];
    return layers[key] ?? layers.picture;
  }

  // Index of the picture and layer on the right of a split: another picture, or another map of the same one.
  get right() {
    const { of, other } = this.state;
    const [kind, id] = (other ?? "of " + of).split(" ");
    return kind === "of" ? [Number(id), this.layer(Number(id))] : [of, this.layer(of, id)];
  }

  // Keys of the maps of any picture, in their order.
  get maps() {
    return [...new Set(this.pictures.flatMap(({ layers }) => Object.keys(layers)))];
  }

  choices() {
    const { pictures } = this;
    const radio = ({ name }, of) => {
      const input = el("input", { type: "radio", name: "picture", value: of });
      input.addEventListener("change", () => this.set({ of }));
      return el("label", {}, input, el("span", {}, name));
    };
    this.radios = pictures.map(radio);
    find("#pictures").append(...this.radios);
    find("#pictures").hidden = pictures.length < 2;
    find("#split").hidden = pictures.length < 2 && this.maps.length < 2;
    this.select = find("#map");
    this.select.append(...this.maps.map((key) => el("option", { value: key }, MAPS[key]?.[0] ?? "Picture")));
    this.select.addEventListener("change", () => this.set({ key: this.select.value }));
    [this.splits, this.others] = [find("#split input"), find("#split select")];
    const others = pictures.length < 2 ? [] : pictures.map(({ name }, of) => [`of ${of}`, name]);
    others.push(...this.maps.map((key) => [`key ${key}`, MAPS[key]?.[0] ?? "Picture"]));
    this.others.append(...others.map(([value, name]) => el("option", { value }, name)));
    this.others.value = pictures.length < 2 ? `key ${this.maps[1]}` : `of ${this.state.before}`;
    const split = () => this.set({ other: this.splits.checked ? this.others.value : null });
    this.splits.addEventListener("change", split);
    this.others.addEventListener("change", () => {
      this.splits.checked = true;
      split();
    });
  }

  sliders() {
    this.exposure = find("#exposure input");
    const [min, max] = [this.automatic - EXPOSURE_RANGE, this.automatic + EXPOSURE_RANGE];
    Object.assign(this.exposure, { min: Math.min(0, min), max: Math.max(0, max) });
    this.exposure.addEventListener("input", () => this.set({ stops: Number(this.exposure.value) }));
    find("#automatic").addEventListener("click", () => this.set({ stops: this.automatic }));
    find("#unexposed").addEventListener("click", () => this.set({ stops: 0 }));
    this.boundary = find("#boundary");
    this.boundary.addEventListener("input", () => this.set({ boundary: Number(this.boundary.value) }));
    this.divider.addEventListener("pointerdown", (event) => {
      this.divider.setPointerCapture(event.pointerId);
      event.stopPropagation();
    });
    this.divider.addEventListener("pointermove", (event) => {
      if (!this.divider.hasPointerCapture(event.pointerId)) return;
      const { left, width } = this.stage.box.getBoundingClientRect();
      this.set({ boundary: Math.min(100, Math.max(0, (100 * (event.clientX - left)) / width)) });
      event.stopPropagation();
    });
    for (const button of document.querySelectorAll("#zoom button")) {
      button.addEventListener("click", () => this.camera.key({ key: button.dataset.key }, false));
    }
  }

  // Keys act in all views, and elsewhere unless an element that takes keys has the focus.
  keys() {
    const step = (list, at, by) => list[(list.indexOf(at) + by + list.length) % list.length];
    addEventListener("keydown", (event) => {
      if (event.ctrlKey || event.metaKey || event.altKey || event.defaultPrevented) return;
      if (event.target.closest("input:not([type=radio]), select, textarea")) return;
      const { state, maps, pictures } = this;
      const of = [...pictures.keys()];
      const act = {
        n: () => this.set({ of: step(of, state.of, 1) }),
        p: () => this.set({ of: step(of, state.of, -1) }),
        b: () => this.set({ of: state.before }),
        m: () => this.set({ key: step(maps, state.key, 1) }),
        M: () => this.set({ key: step(maps, state.key, -1) }),
        e: () => this.set({ stops: state.stops + EXPOSURE_STEP }),
        E: () => this.set({ stops: state.stops - EXPOSURE_STEP }),
        a: () => this.set({ stops: this.automatic }),
        s: () => this.set({ other: state.other === null ? this.others.value || null : null }),
      }[event.key];
      const inView = event.target.closest(".view") !== null;
      if (act) act();
      else if (!this.camera.key(event, inView)) return;
      event.preventDefault();
    });
  }

  // Changes the state, and draws what depends on it.
  set(change) {
    const before = this.state;
    const { min, max } = this.exposure;
    const state = { ...before, ...change };
    state.stops = Math.min(Number(max), Math.max(Number(min), state.stops));
    if (state.of !== before.of) state.before = before.of;
    // A flip to the picture on the right puts the other one there.
    if (state.other === `of ${state.of}`) state.other = `of ${state.before}`;
    this.state = state;
    this.draw();
    if (state.stops !== before.stops || state.key !== before.key) this.redraw();
  }

  get gain() {
    return 2 ** this.state.stops;
  }

  draw() {
    const { of, key, other, boundary, stops } = this.state;
    const layer = this.layer(of);
    this.stage.show(layer, this.gain);
    const isSplit = other !== null;
    this.stage.panes = this.stage.panes.slice(0, 1);
    if (isSplit) {
      this.stage.panes.push(this.over);
      this.stage.panes[0].element.after(this.over.element);
      this.stage.show(this.right[1], this.gain, 1);
    } else {
      this.over.element.remove();
    }
    this.stage.box.style.setProperty("--boundary", `${boundary}%`);
    this.divider.hidden = this.labels[1].hidden = find("#boundary").parentElement.hidden = !isSplit;
    const label = (index, shown) => [index, shown].filter((part) => part !== "").join(" · ");
    const title = (one) => (one.key === "picture" && this.pictures.length > 1 ? "" : one.title);
    const name = (index) => (this.pictures.length > 1 ? this.pictures[index].name : "");
    [[of, layer], this.right].forEach(([index, one], side) => {
      const text = label(name(index), title(one));
      this.labels[side].textContent = text;
      this.labels[side].hidden = !isSplit && (side === 1 || text === "Picture");
    });
    this.stage.box.setAttribute("aria-label", label(name(of), layer.title));
    find("input", this.radios[of]).checked = true;
    this.select.value = key;
    this.splits.checked = isSplit;
    this.others.value = other ?? this.others.value;
    this.boundary.value = boundary;
    this.exposure.value = stops;
    find("#exposure output").value = stopsText(stops);
    find("#exposure").hidden = !layer.isRadiance && layer.scale !== "records";
    find("#automatic").setAttribute("aria-pressed", stops === this.automatic);
    find("#unexposed").setAttribute("aria-pressed", stops === 0 && this.automatic !== 0);
    const range = layer.isRadiance ? null : layer.range;
    const isEmpty = !layer.isRadiance && layer.scale !== "records" && range === null;
    const text = layer.isRadiance ? [] : [el("p", {}, isEmpty ? NOTHING : layer.text)];
    find("#legend").replaceChildren(...(range ? [scaleBar(range, layer)] : []), ...text);
    this.read();
  }

  // Draws the views below the stage again, in the next frame.
  redraw() {
    this.waiting ??= requestAnimationFrame(() => {
      this.waiting = undefined;
      this.figures.forEach((figure) => figure.draw());
      this.read();
    });
  }

  // Figure of a layer in a linked view; `layerOf` may depend on the state.
  figure(layerOf, caption) {
    const view = new View(this.camera, layerOf().title);
    const value = el("output", { class: "value" });
    const scale = el("div");
    const text = el("figcaption");
    const draw = () => {
      const layer = layerOf();
      view.show(layer, this.gain);
      const range = layer.isRadiance ? null : layer.range;
      scale.replaceChildren(...(range ? [scaleBar(range, layer)] : []));
      const [title, note] = caption(layer);
      const isEmpty = !layer.isRadiance && layer.scale !== "records" && range === null;
      text.replaceChildren(scale, el("h3", {}, title, value), el("p", {}, isEmpty ? NOTHING : note));
      view.box.setAttribute("aria-label", title);
    };
    const read = ([x, y]) => {
      const layer = layerOf();
      value.value = layer.isRadiance ? "" : layer.format(layer.at(x, y)[0]);
    };
    this.figures.push({ draw, read });
    draw();
    return el("figure", {}, view.box, text);
  }

  // Figures of the maps `keys` of the first picture that has them.
  figuresOf(keys) {
    const { layers } = this.pictures[0];
    return keys.filter((key) => key in layers).map((key) =>
      this.figure(() => layers[key], (layer) => [layer.title, layer.text]));
  }

  // Values of all pictures at the marked pixel, with their errors.
  read() {
    const { pixel, magnification, zoom } = this.camera;
    find("#zoom output").value = (zoom === 1 ? "fit, " : "") + percent(magnification, magnification < 10 ? 3 : 4);
    const at = pixel && [pixel[0] + 0.5, pixel[1] + 0.5];
    const row = ({ name, layers: { picture } }, of) => {
      const errors = picture.errors && at ? picture.errors.at(...at) : null;
      const values = at ? picture.at(...at) : [null, null, null];
      const cell = (value, c) => [orDash(value), errors && el("small", {}, ` ± ${number(errors[c], 2)}`)];
      const head = el("th", { scope: "row" }, this.pictures.length > 1 ? name : "value");
      const cells = values.map((value, c) => el("td", {}, cell(value, c)));
      return el("tr", { class: of === this.state.of ? "chosen" : null }, head, cells);
    };
    find("#pixel").textContent = pixel ? `pixel ${pixel[0]}, ${pixel[1]}` : "pixel";
    find("#readout tbody").replaceChildren(...this.pictures.map(row));
    if (at) this.figures.forEach((figure) => figure.read(at));
    const layer = this.layer(this.state.of);
    find("#shown").textContent = at && !layer.isRadiance ? `${layer.title}: ${layer.format(layer.at(...at)[0])}` : "";
  }
}
