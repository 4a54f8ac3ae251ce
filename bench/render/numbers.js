// Elements, numbers as a person reads them, tables and what of them is shown, scales.
const data = JSON.parse(document.getElementById("data").textContent);
const FIRST = 6; // panels, and
const ROWS = 200; // rows of a table, shown before one asks for all
const REACH = 30; // px from the pointer to a point that is told about
const UNITS = { s: [[1, "s"], [1e-3, "ms"], [1e-6, "µs"], [1e-9, "ns"]], byte: [[1e9, "GB"], [1e6, "MB"], [1e3, "kB"], [1, "B"]] };
const RAMP = ["#00204d", "#1f3a6d", "#4a546c", "#6a6e72", "#8b8978", "#aea472", "#d3c164", "#ffe945"]; // cividis

// ---- elements

const make = (name, attributes, children, space) => {
  const node = space ? document.createElementNS(space, name) : document.createElement(name);
  for (const [key, value] of Object.entries(attributes || {})) if (value !== undefined) node.setAttribute(key, value);
  for (const child of children || []) if (child !== null && child !== undefined) node.append(child);
  return node;
};
const html = (name, attributes, ...children) => make(name, attributes, children);
const svg = (name, attributes, ...children) => make(name, attributes, children, "http://www.w3.org/2000/svg");
const button = (text, act, attributes) => {
  const node = html("button", { type: "button", ...attributes }, text);
  node.addEventListener("click", act);
  return node;
};

// ---- numbers

const digits = (value, n) => {
  const size = Math.abs(value);
  if (value === 0 || (Number.isInteger(value) && size < 1e6)) return String(value);
  if (size >= 1e-3 && size < 1e5) return String(Number(value.toPrecision(n)));
  return value.toExponential(n - 1).replace(/\.?0*e/, "e").replace("e+", "e");
};
const inUnit = (value, unit, n) => {
  const [factor, name] = UNITS[unit].find(([factor]) => Math.abs(value) >= factor * 0.9999) || UNITS[unit].at(-1);
  return value === 0 ? `0 ${unit === "s" ? "s" : "B"}` : `${digits(value / factor, n)} ${name}`;
};
const shown = (column, value) =>
  value === null || value === undefined ? "" : typeof value !== "number" ? String(value)
    : column.unit === "byte" ? binary(value) : column.unit === "s" ? inUnit(value, "s", 3) : digits(value, 4);
const binary = (value) => { // as the command line has it
  let k = 0;
  while (value >= 1000 && k < 4) [value, k] = [value / 1024, k + 1];
  return `${digits(value, 3)} ${["B", "KiB", "MiB", "GiB", "TiB"][k]}`;
};
const SUPERSCRIPT = "⁰¹²³⁴⁵⁶⁷⁸⁹";
const power = (k) => (k >= -2 && k <= 3 ? String(Number((10 ** k).toPrecision(1))) : `10${[...String(k)].map((c) => (c === "-" ? "⁻" : SUPERSCRIPT[c])).join("")}`);

// ---- tables and filters

const bare = (text) => (/^[^[,]+/.exec(text || "") || [""])[0];
const selector = (text) => (/^[^[,]+(\[[^\]]*\])?/.exec(text || "") || [""])[0];
const tables = data.tables.map(({ columns, data: values }) => {
  const table = { columns: columns.map(([name, unit, type, meaning], i) => ({ name, unit, number: type !== "TEXT", meaning, values: Array.isArray(values[i]) ? values[i] : values[i].at.map((k) => (k < 0 ? null : values[i].of[k])) })) };
  table.column = Object.fromEntries(table.columns.map((column) => [column.name, column]));
  table.size = table.columns.length ? table.columns[0].values.length : 0;
  table.problem = table.column.problem ? table.column.problem.values.map(selector) : null;
  table.route = table.column.route ? table.column.route.values.map(bare) : null;
  return table;
});
const problems = [...new Set(tables.flatMap((t) => t.problem || []))].filter(Boolean);
const off = { problem: new Set(), route: new Set() };
const kept = (table, row) => !((table.problem && off.problem.has(table.problem[row])) || (table.route && off.route.has(table.route[row])));
const rowsOf = (state) => [...Array(state.table.size).keys()].filter((row) => kept(state.table, row));
const columnsOf = (state) => state.table.columns.filter((column) => !off.route.has(column.name));

// ---- scales: values to [0, 1] and ticks; zero has a place of its own below a log axis

const scaleOf = (axis, values, view) => {
  const log = axis.scale === "log";
  const to = log ? (v) => Math.log10(v) : (v) => v;
  const known = values.filter((v) => Number.isFinite(v) && (!log || v > 0)).map(to);
  const zero = log && values.some((v) => v === 0);
  let low = known.length ? known.reduce((a, b) => Math.min(a, b)) : 0;
  let high = known.length ? known.reduce((a, b) => Math.max(a, b)) : 1;
  if (high - low < 1e-12 * Math.max(1, Math.abs(high))) {
    const room = log ? 0.5 : Math.abs(low) * 0.1 || 1;
    [low, high] = [low - room, high + room];
  }
  const bottom = zero ? low - Math.max(0.8, 0.12 * (high - low)) : low;
  const pad = 0.04 * (high - bottom);
  const [a, b] = view || [bottom - pad, high + pad];
  const place = (v) => (v === 0 && log ? bottom : v > 0 || !log ? to(v) : NaN);
  return { at: (v) => (place(v) - a) / (b - a), back: (f) => a + f * (b - a), range: [a, b], ticks: ticksOf(axis, a, b, log, zero ? bottom : null, low, known.every(Number.isInteger)) };
};
const ticksOf = (axis, a, b, log, zero, low, whole) => {
  const name = (v) => (axis.unit in UNITS ? inUnit(v, axis.unit, 3) : digits(v, 4));
  const ticks = [];
  if (log && b - a > 1.3) {
    const step = Math.ceil((b - a) / 7);
    const from = zero === null ? a : Math.max(a, low - 0.3);
    for (let k = Math.ceil(from / step) * step; k <= b; k += step) ticks.push({ v: 10 ** k, label: axis.unit in UNITS ? name(10 ** k) : power(k) });
  } else if (log && b - a > 0.25) {
    for (let k = Math.floor(a); k <= b; k++) for (const m of b - a > 0.45 ? [1, 2, 5] : [1, 1.2, 1.5, 2, 2.5, 3, 4, 5, 6, 8]) {
      const t = k + Math.log10(m);
      if (t >= a && t <= b && (zero === null || t >= low - 0.3)) ticks.push({ v: m * 10 ** k, label: name(m * 10 ** k) });
    }
  } else {
    const [from, to] = log ? [10 ** a, 10 ** b] : [a, b];
    const raw = (to - from) / 6;
    const size = 10 ** Math.floor(Math.log10(raw));
    const step = Math.max([1, 2, 5, 10].find((m) => m * size >= raw) * size, whole ? 1 : 0);
    for (let k = Math.ceil(from / step); k * step <= to; k++) ticks.push({ v: k * step, label: name(Number((k * step).toPrecision(12))) });
  }
  if (zero !== null && zero >= a) ticks.push({ v: 0, label: "0" });
  return ticks;
};
const bandsOf = (points, thick, gap) => { // a band a category, as high as it has bars
  const lanes = new Map();
  for (const p of points) lanes.set(p.y, [...(lanes.get(p.y) || []), p]);
  let total = 0;
  const middle = new Map();
  for (const [name, own] of lanes) {
    const size = thick * own.length + gap;
    own.forEach((p, k) => { p.lane = (k - (own.length - 1) / 2) * thick; });
    middle.set(name, total + size / 2);
    total += size;
  }
  return { total, at: (v) => middle.get(v) / total, ticks: [...lanes.keys()].map((v) => ({ v, label: v })) };
};
