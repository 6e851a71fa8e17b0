"use strict";
// Text of quantities, and elements whose text is never markup.

const THIN = "\u202f";

// Count, with thin spaces between thousands from five digits on.
const grouped = (count) => {
  const digits = String(count);
  return digits.length < 5 ? digits : digits.replace(/\B(?=(\d{3})+$)/g, THIN);
};

const plural = (count, noun) => `${grouped(count)} ${noun}${count === 1 ? "" : "s"}`;

const raised = (c) => "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"["-0123456789".indexOf(c)];

const powerOfTen = (exponent) => `10${[...String(exponent)].map(raised).join("")}`;

// Number with so many significant digits, plain from 0.01 to 9999 and otherwise as 2.4 × 10⁻³.
const number = (value, digits = 3) => {
  if (value === 0) return "0";
  if (value == null || Number.isNaN(value)) return "unknown";
  const sign = value < 0 ? "−" : "";
  if (!Number.isFinite(value)) return sign + "∞";
  const [mantissa, exponent] = Math.abs(value).toExponential(digits - 1).split("e");
  if (exponent < -2 || exponent > 3) return `${sign}${mantissa}\u00a0×\u00a0${powerOfTen(Number(exponent))}`;
  return sign + Math.abs(value).toFixed(Math.max(0, digits - 1 - exponent));
};

const orDash = (value, text = number) => (value == null ? "–" : text(value));

const range = (ends) => ends.map((end) => number(end, 3)).join(" to ");

const percent = (fraction, digits = 2) => `${number(100 * fraction, digits)}${THIN}%`;

const signedPercent = (fraction) => (fraction > 0 ? "+" : "") + percent(fraction);

const duration = (s) => {
  const two = (value) => String(Math.floor(value)).padStart(2, "0");
  if (s < 0.0995) return `${(s * 1e3).toFixed(0)} ms`;
  if (s < 99.95) return `${s.toFixed(1)} s`;
  if (s < 5400) return `${Math.floor(s / 60)} min ${two(s % 60)} s`;
  return `${Math.floor(s / 3600)} h ${two((s / 60) % 60)} min`;
};

const byteCount = (bytes) => {
  if (bytes < 1024) return `${bytes} bytes`;
  const units = ["KiB", "MiB", "GiB", "TiB"];
  let value = bytes / 1024;
  while (value >= 1000 && units.length > 1) {
    value /= 1024;
    units.shift();
  }
  return `${value.toFixed(1)} ${units[0]}`;
};

// Name in snake case as words.
const words = (name) => name.replaceAll("_", " ");

// Command for a POSIX shell.
const shell = (command) =>
  command.map((word) => (/^[\w@%+=:,./-]+$/.test(word) ? word : `'${word.replaceAll("'", `'\\''`)}'`)).join(" ");

const filled = (element, attributes, children) => {
  for (const [name, value] of Object.entries(attributes)) if (value != null) element.setAttribute(name, value);
  element.append(...children.flat().filter((child) => child != null && child !== false));
  return element;
};

// Element with attributes and children; strings become text.
const el = (tag, attributes = {}, ...children) => filled(document.createElement(tag), attributes, children);

const svg = (tag, attributes = {}, ...children) =>
  filled(document.createElementNS("http://www.w3.org/2000/svg", tag), attributes, children);

const find = (selector, root = document) => root.querySelector(selector);

// Shows an element that the document hides, with its children.
const show = (selector, ...children) => {
  const element = find(selector);
  if (children.length > 0) element.replaceChildren(...children.flat());
  element.hidden = false;
  return element;
};

const facts = (pairs) => pairs.map(([name, value]) => el("div", {}, el("dt", {}, name), el("dd", {}, value)));

// Table of numbers, whose first column names the rows if `named`.
const table = (label, head, rows, named = true) => {
  const cell = (text, column) => (column === 0 && named ? el("th", { scope: "row" }, text) : el("td", {}, text));
  return el("div", { class: "scroll", tabindex: 0, role: "region", "aria-label": label },
    el("table", { class: "numbers" },
      el("thead", {}, el("tr", {}, head.map((name) => el("th", { scope: "col" }, name)))),
      el("tbody", {}, rows.map((row) => el("tr", {}, row.map(cell))))));
};

// Table of names and texts.
const pairs = (caption, rows) =>
  el("table", { class: "counts" }, el("caption", {}, caption),
    el("tbody", {}, rows.map(([name, text]) => el("tr", {}, el("th", { scope: "row" }, name), el("td", {}, text)))));

// Table of names, amounts, and bars in proportion to the largest value.
const bars = (caption, rows, text) => {
  const most = Math.max(...rows.map(([, value]) => value), Number.MIN_VALUE);
  const row = ([name, value]) => {
    const bar = el("i");
    bar.style.width = `${(100 * value) / most}%`;
    const cells = [el("th", { scope: "row" }, name), el("td", {}, text(value))];
    return el("tr", {}, cells, el("td", { class: "bar", "aria-hidden": "true" }, bar));
  };
  return el("table", { class: "bars" }, el("caption", {}, caption), el("tbody", {}, rows.map(row)));
};
