// Values of pixels: decoding, maps derived from them, and their colours.

// Floats of a layer, from four planes of bytes, the most significant first (layers.rs).
const decode = async ({ data, width, height, channels }) => {
  const packed = Uint8Array.from(atob(data), (c) => c.charCodeAt(0));
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate"));
  const planes = new Uint8Array(await new Response(stream).arrayBuffer());
  const count = width * height * channels;
  const bits = new Uint32Array(count);
  for (let i = 0; i < count; i++) {
    bits[i] = (planes[i] << 24) | (planes[count + i] << 16) | (planes[2 * count + i] << 8) | planes[3 * count + i];
  }
  return new Float32Array(bits.buffer);
};

// Mean over squares of 3 × 3 pixels, twice: a variance from two halves is itself off by a factor, and two passes
// turn a bright pixel into a soft spot.
const smoothed = (values, width, height, channels) => {
  // Means of three neighbours along `count` lines of `size` pixels.
  const along = (from, size, step, count, stride) => {
    const to = new Float32Array(from.length);
    for (let line = 0; line < count; line++) {
      for (let channel = 0; channel < channels; channel++) {
        const start = line * stride + channel;
        for (let i = 0; i < size; i++) {
          const first = Math.max(0, i - 1);
          const last = Math.min(size - 1, i + 1);
          let sum = 0;
          for (let near = first; near <= last; near++) sum += from[start + near * step];
          to[start + i * step] = sum / (last - first + 1);
        }
      }
    }
    return to;
  };
  const [pixel, row] = [channels, width * channels];
  const pass = (from) => along(along(from, width, pixel, height, row), height, row, width, pixel);
  return pass(pass(values));
};

const mean = (values) => values.reduce((sum, value) => sum + value, 0) / Math.max(1, values.length);

// Value at a fraction of the sorted values.
const quantile = (sorted, order) => sorted[Math.min(sorted.length - 1, Math.floor(sorted.length * order))];

// Colours from 0 to 1: of errors, whose lightness increases, and of signed errors, white in the middle.
const HEAT = [[0, 0, 5], [82, 18, 122], [184, 54, 120], [252, 135, 97], [252, 252, 191]];
const SIGNED = [[5, 48, 115], [79, 156, 217], [247, 247, 247], [240, 135, 92], [128, 10, 20]];

const RIM = [140, 230, 255];
const RECORD = [255, 140, 26];

// Factor that darkens the picture below records.
const DIMMED = 0.4;

const between = (stops, position) => {
  const at = Math.min(1, Math.max(0, position || 0)) * (stops.length - 1);
  const below = Math.min(stops.length - 2, Math.floor(at));
  return stops[below].map((start, c) => start + (stops[below + 1][c] - start) * (at - below));
};

// The sRGB curve in bytes, by the square root of the linear value: finer where it is dark.
const DISPLAY = Uint8ClampedArray.from({ length: 4097 }, (_, i) => {
  const x = (i / 4096) ** 2;
  return 255 * (x <= 0.0031308 ? 12.92 * x : 1.055 * x ** (1 / 2.4) - 0.055);
});

const display = (value) => DISPLAY[Math.round(4096 * Math.sqrt(Math.min(1, Math.max(0, value || 0))))];

// Colour scales of maps: stops, labels, and the position of a value.
const MAX_RANGE = 1e6;
const MIN_RANGE = 10;

const scales = {
  // Logarithmic, from the 1 % quantile to the 99.5 % quantile of the positive values.
  log(values) {
    const positive = values.filter((value) => value > 0 && Number.isFinite(value)).sort();
    if (positive.length === 0) return null;
    const high = quantile(positive, 0.995);
    const low = Math.min(Math.max(quantile(positive, 0.01), high / MAX_RANGE), high / MIN_RANGE);
    const position = (value) => (value > 0 ? Math.log(value / low) / Math.log(high / low) : 0);
    return { stops: HEAT, labels: [low, Math.sqrt(low * high), high], position };
  },
  linear(values) {
    const [low, high] = [values.reduce((a, b) => Math.min(a, b)), values.reduce((a, b) => Math.max(a, b))];
    return { stops: HEAT, labels: [low, (low + high) / 2, high], position: (value) => (value - low) / (high - low) };
  },
  unit: () => ({ stops: HEAT, labels: [0, 0.5, 1], position: (value) => value }),
  // Up to the magnitude that one value in 200 exceeds.
  signed(values) {
    const sizes = values.map(Math.abs).filter((size) => size > 0 && Number.isFinite(size)).sort();
    if (sizes.length === 0) return null;
    const end = quantile(sizes, 0.995);
    return { stops: SIGNED, labels: [-end, 0, end], position: (value) => 0.5 + (value / end / 2 || 0) };
  },
};

const joined = (arrays) => {
  const all = new Float32Array(arrays.reduce((sum, array) => sum + array.length, 0));
  arrays.reduce((at, array) => (all.set(array, at), at + array.length), 0);
  return all;
};

// Values of pixels with their name, and colours by a scale or as radiance.
class Layer {
  constructor(raw, properties) {
    const { width, height, covers, channels } = raw;
    Object.assign(this, { width, height, covers, channels, values: raw.values }, properties);
    this.painted = null;
  }

  // Values at a point of the picture in pixels, one for each channel.
  at(x, y) {
    const column = Math.min(this.width - 1, Math.floor((x / this.covers[0]) * this.width));
    const row = Math.min(this.height - 1, Math.floor((y / this.covers[1]) * this.height));
    const start = (row * this.width + column) * this.channels;
    return [...this.values.subarray(start, start + this.channels)];
  }

  get isRadiance() {
    return this.scale === undefined;
  }

  // Colour scale of the map, the same for all methods; null without values.
  get range() {
    const group = this.group ?? (this.group = { layers: [this] });
    if (!("range" in group)) group.range = scales[this.scale](joined(group.layers.map((layer) => layer.values)));
    return group.range;
  }

  // Canvas of the layer; `gain` multiplies radiance.
  canvas(gain) {
    const key = this.isRadiance || this.scale === "records" ? gain : 1;
    if (this.painted === key) return this.drawn;
    this.drawn ??= el("canvas", { width: this.width, height: this.height });
    const context = this.drawn.getContext("2d");
    const image = context.createImageData(this.width, this.height);
    this.paint(image.data, gain);
    context.putImageData(image, 0, 0);
    this.painted = key;
    return this.drawn;
  }

  paint(pixels, gain) {
    const { values } = this;
    const range = this.isRadiance ? null : this.range;
    const table = range && Array.from({ length: 1025 }, (_, i) => between(range.stops, i / 1024));
    for (let pixel = 0, at = 0; at < pixels.length; pixel++, at += 4) {
      pixels[at + 3] = 255;
      if (this.isRadiance) {
        for (let c = 0; c < 3; c++) pixels[at + c] = display(values[3 * pixel + c] * gain);
      } else {
        const position = range ? range.position(values[pixel]) : 0;
        const colour = range ? table[Math.round(1024 * Math.min(1, Math.max(0, position || 0)))] : HEAT[0];
        for (let c = 0; c < 3; c++) pixels[at + c] = colour[c] + 0.5;
      }
    }
  }
}

// Records over the picture: 1 is a rim, 2 a record.
class Records extends Layer {
  get range() {
    return null;
  }

  paint(pixels, gain) {
    for (let pixel = 0, at = 0; at < pixels.length; pixel++, at += 4) {
      const [x, y] = [pixel % this.width, Math.floor(pixel / this.width)];
      const below = () =>
        this.picture.at((x + 0.5) * (this.covers[0] / this.width), (y + 0.5) * (this.covers[1] / this.height));
      const colour = [null, RIM, RECORD][this.values[pixel]] ?? below().map((v) => display(DIMMED * v * gain));
      for (let c = 0; c < 3; c++) pixels[at + c] = colour[c];
      pixels[at + 3] = 255;
    }
  }
}

const UNIT = "W/(m² sr)";

// Title, text, scale, text of a value, and its unit, of maps by their key.
const MAPS = {
  standard: ["Standard error", `Standard deviation of the mean of each pixel, in ${UNIT}.`, "log", (v) => number(v, 2), ` ${UNIT}`],
  relative: ["Relative error", "Standard error over the brightness of the pixel, as in relMSE: bright pixels dominate the error.", "log", (v) => percent(v)],
  variance: ["Variance of a sample", `Noise of the light for any number of samples, in (${UNIT})².`, "log", (v) => number(v, 2)],
  samples: ["Samples", "Samples of each pixel.", "linear", (v) => grouped(Math.round(v))],
  bias: ["Bias", "Relative deviation of regions: blue is too dark, red is too bright, white is within two standard errors. One unbiased region in twenty has a colour.", "signed", signedPercent],
  difference: ["Relative difference", "Blue is too dark, red is too bright. The mean square is the relMSE.", "signed", signedPercent],
  flip: ["FLIP", "Visible difference of the PNGs at 67 pixels per degree, from 0 (none) to 1 (largest).", "unit", (v) => number(v, 2)],
  records: ["Records", "Records of the cache of even samples: dots are records, lines are the borders of their validity.", "records", (v) => ["none", "border", "record"][v]],
  radii: ["Radii", "Mean validity radius of the records at a pixel, in pixels. Black pixels have no record and are path traced.", "log", (v) => number(v, 2)],
  predicted: ["Predicted error", "Error that the records predict, relative to the irradiance.", "log", (v) => (Number.isNaN(v) ? "no record" : percent(v))],
  achieved: ["True error", "Relative error at the test points: blue is too dark, red is too bright, white was not tested.", "signed", signedPercent],
};
for (const [key, name] of [["photon", "photons"], ["caustic_photon", "caustic photons"]]) {
  const counts = (v) => number(v, 2);
  MAPS[`${key}s`] = [`Visible ${name}`, "Photons per pixel, except behind glass and in mirrors", "log", counts];
  MAPS[`${key}_density`] = [`Density of ${name}`, "Photons per square metre of surface, from the nearest 64. Glass and mirrors hold no photons and show the density nearby.", "log", counts, " /m²"];
  MAPS[`${key}_radius`] = [`Radius of ${name}`, "Radius of the nearest 64 in metres: the blur of an estimate from as many photons.", "log", counts, " m"];
}

const mapProperties = (key) => {
  const [title, text, scale, label, unit = ""] = MAPS[key];
  return { key, title, text, scale, label, format: (value) => label(value) + unit };
};

// Map of one value for each pixel of `raw`.
const derived = (key, raw, values) => new Layer({ ...raw, channels: 1, values }, mapProperties(key));

// Maps of the estimated error, from the `variances` of the channels of `picture`.
const errorMaps = (run, picture, variances, samples) => {
  const { values, width, height } = picture;
  const whole = mean(run.mean_radiance);
  const floor = 0.01 * whole * whole;
  const [absolute, relative, ofSample] = [0, 1, 2].map(() => new Float32Array(width * height));
  for (let pixel = 0; pixel < width * height; pixel++) {
    for (let i = 3 * pixel; i < 3 * pixel + 3; i++) {
      const variance = variances[i] / 3;
      absolute[pixel] += variance;
      relative[pixel] += variance / (values[i] * values[i] + floor);
    }
    ofSample[pixel] = absolute[pixel] * (samples ? samples.values[pixel] : run.samples[0]);
  }
  const flat = (map) => smoothed(map, width, height, 1);
  return {
    standard: derived("standard", picture, flat(absolute).map(Math.sqrt)),
    relative: derived("relative", picture, flat(relative).map(Math.sqrt)),
    variance: derived("variance", picture, flat(ofSample)),
  };
};

// Map of the deviations of regions that an audit finds.
const biasMap = ({ regions }, picture) => {
  const { width, height, covers } = picture;
  const shown = regions.filter(({ mean, error }) => Math.abs(mean) > 2 * error);
  const within = (at, start, size) => at >= start && at < start + size;
  const values = Float32Array.from({ length: width * height }, (_, pixel) => {
    const x = ((pixel % width + 0.5) * covers[0]) / width;
    const y = ((Math.floor(pixel / width) + 0.5) * covers[1]) / height;
    return shown.find((one) => within(x, one.x, one.width) && within(y, one.y, one.height))?.mean ?? 0;
  });
  return derived("bias", picture, values);
};

// Map of (I − R) / √(R² + 0.01 m²), whose mean square is the relMSE; m is the mean of the reference R.
const differenceMap = (run, picture, reference) => {
  const finite = () => mean([...reference.values.filter(Number.isFinite)]);
  const floor = 0.01 * (run.error.reference_mean ?? finite()) ** 2;
  const values = new Float32Array(picture.width * picture.height);
  for (let i = 0; i < 3 * values.length; i++) {
    const [a, b] = [picture.values[i], reference.values[i]];
    // 0 / 0, a black pixel of a black reference, is no error.
    if (a !== b) values[Math.floor(i / 3)] += (a - b) / Math.sqrt(b * b + floor) / 3;
  }
  return derived("difference", picture, values);
};

// Layers of a render by key. `picture.errors` are the standard errors of its channels.
const layersOf = (run, raws, reference) => {
  const raw = Object.fromEntries(raws.map((one) => [one.name, one]));
  const layers = { picture: new Layer(raw.picture, { key: "picture", title: "Picture" }) };
  if (raw.variances) {
    const { values, width, height } = raw.variances;
    layers.picture.errors = new Layer({ ...raw.variances, values: smoothed(values, width, height, 3).map(Math.sqrt) }, {});
    Object.assign(layers, errorMaps(run, raw.picture, values, raw.samples));
  }
  if (run.error.bias?.found) layers.bias = biasMap(run.error.bias, raw.picture);
  if (reference) layers.difference = differenceMap(run, raw.picture, reference);
  for (const [name, one] of Object.entries(raw).filter(([name]) => name in MAPS)) {
    layers[name] = new (name === "records" ? Records : Layer)(one, { ...mapProperties(name), picture: layers.picture });
    if (name.endsWith("photons")) layers[name].text += `: ${percent(one.visible)} of all are visible.`;
  }
  return layers;
};
