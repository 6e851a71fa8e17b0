"use strict";
// Exposure: the radiance of a picture is in `data-radiance`, a PNG of twice its height. Above are the mantissas of
// red, green and blue, below is their common exponent: value = mantissa * 2^(exponent - 136).

const POWERS = Float32Array.from({ length: 256 }, (_, exponent) => 2 ** (exponent - 136));

// The sRGB curve, by the square root of the linear value: finer where it is dark.
const DISPLAY = Uint8ClampedArray.from({ length: 4097 }, (_, i) => {
  const x = (i / 4096) ** 2;
  return 255 * (x <= 0.0031308 ? 12.92 * x : 1.055 * x ** (1 / 2.4) - 0.055);
});

// Puts a canvas in the place of an image; resolves to it, with `radiance(x, y)` and `expose(stops)`.
async function develop(img) {
  if (img.developing) return img.developing;
  return (img.developing = (async () => {
    const coded = new Image();
    coded.src = img.dataset.radiance;
    await coded.decode();
    const [width, height] = [coded.width, coded.height / 2];
    const canvas = document.createElement("canvas");
    Object.assign(canvas, { width, height: 2 * height, className: img.className });
    const context = canvas.getContext("2d", { willReadFrequently: true });
    context.drawImage(coded, 0, 0);
    const bytes = context.getImageData(0, 0, width, 2 * height).data;
    canvas.height = height;
    canvas.setAttribute("role", "img");
    canvas.setAttribute("aria-label", img.alt);
    const shown = context.createImageData(width, height);
    const below = 4 * width * height;

    canvas.radiance = (x, y) => {
      const at = 4 * (y * width + x);
      return [0, 1, 2].map((c) => bytes[at + c] * POWERS[bytes[below + at]]);
    };
    canvas.expose = (stops) => {
      const gain = 2 ** stops;
      for (let at = 0; at < below; at += 4) {
        const scale = POWERS[bytes[below + at]] * gain;
        for (let c = 0; c < 3; c++) {
          const value = Math.min(1, bytes[at + c] * scale);
          shown.data[at + c] = DISPLAY[Math.round(4096 * Math.sqrt(value))];
        }
        shown.data[at + 3] = 255;
      }
      context.putImageData(shown, 0, 0);
    };
    img.replaceWith(canvas);
    return canvas;
  })());
}

// The pictures of a figure follow its slider; the first says what is under the pointer.
for (const figure of document.querySelectorAll("figure.picture")) {
  const panel = figure.querySelector(".exposure");
  const [slider, output, button] = ["input", "output", "button"].map((name) => panel.querySelector(name));
  const probe = panel.querySelector(".probe");
  panel.hidden = false;

  figure.expose = async () => {
    const stops = Number(slider.value);
    output.value = (stops > 0 ? "+" : "") + String(stops).replace("-", "−") + (Math.abs(stops) === 1 ? " stop" : " stops");
    const pictures = [...figure.querySelectorAll("img[data-radiance]")];
    if (stops !== 0) await Promise.all(pictures.map(develop));
    for (const canvas of figure.querySelectorAll("canvas")) canvas.expose(Number(slider.value));
  };
  slider.addEventListener("input", figure.expose);
  button.addEventListener("click", () => { slider.value = 0; figure.expose(); });
  figure.expose();

  if (!probe) continue;
  figure.addEventListener("pointermove", async (event) => {
    if (event.target.matches("img[data-radiance]")) (await develop(event.target)).expose(Number(slider.value));
    const canvas = figure.querySelector("canvas");
    if (event.target !== canvas) return;
    const box = canvas.getBoundingClientRect();
    const place = (at, start, size, count) =>
      Math.min(count - 1, Math.max(0, Math.floor(((at - start) / size) * count)));
    const x = place(event.clientX, box.left, box.width, canvas.width);
    const y = place(event.clientY, box.top, box.height, canvas.height);
    const values = canvas.radiance(x, y).map((value) => value.toPrecision(2));
    probe.textContent = `pixel ${x}, ${y}: ${values.join("  ")} W/(m² sr)`;
  });
  figure.addEventListener("pointerleave", () => { probe.textContent = ""; });
}

// Two pictures, one over the other, up to where the slider stands.
for (const split of document.querySelectorAll(".split")) {
  const slider = split.querySelector("input");
  slider.hidden = false;
  slider.addEventListener("input", () => split.style.setProperty("--at", slider.value + "%"));
}

// A race: which pictures stand side by side.
for (const figure of document.querySelectorAll(".compared")) {
  const originals = document.querySelectorAll("#pictures img");
  const sides = figure.querySelectorAll(".side");
  figure.querySelectorAll("select").forEach((select, side) => {
    const choose = () => {
      sides[side].replaceChildren(originals[select.selectedIndex].cloneNode());
      figure.expose();
    };
    select.selectedIndex = Math.min(side, originals.length - 1);
    select.addEventListener("change", choose);
    choose();
  });
  figure.hidden = originals.length < 2;
}
