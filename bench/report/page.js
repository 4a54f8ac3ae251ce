"use strict";
// Draws what the report declares: one scale, one panel, one table, one filter for all figures. No dependencies.
(() => {
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
    return { at: (v) => (place(v) - a) / (b - a), back: (f) => a + f * (b - a), range: [a, b], ticks: ticksOf(axis, a, b, log, zero ? bottom : null, low) };
  };
  const ticksOf = (axis, a, b, log, zero, low) => {
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
      const step = [1, 2, 5, 10].find((m) => m * size >= raw) * size;
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

  // ---- marks

  const SHAPES = {
    circle: "M-3.6 0a3.6 3.6 0 1 0 7.2 0a3.6 3.6 0 1 0 -7.2 0Z", square: "M-3.3-3.3H3.3V3.3H-3.3Z", diamond: "M0-4.8L4.8 0L0 4.8L-4.8 0Z",
    up: "M0-4.6L4.5 3.6H-4.5Z", down: "M0 4.6L4.5-3.6H-4.5Z", right: "M4.8 0L-3.8 4.4V-4.4Z",
    plus: "M-1.5-4.6H1.5V-1.5H4.6V1.5H1.5V4.6H-1.5V1.5H-4.6V-1.5H-1.5Z", cross: "M-4.4-2.3L-2.3-4.4L0-2.1L2.3-4.4L4.4-2.3L2.1 0L4.4 2.3L2.3 4.4L0 2.1L-2.3 4.4L-4.4 2.3L-2.1 0Z",
  };
  const colours = (k) => `--line:var(--s${k}); --fill:var(--f${k})`;
  const marker = (k, x, y, name, scale = 1) => {
    const style = data.styles[k];
    return svg("path", { class: `${name} ${style.hollow ? "hollow" : ""}`, d: SHAPES[style.marker], transform: `translate(${x.toFixed(1)} ${y.toFixed(1)})${scale < 1 ? ` scale(${scale})` : ""}` });
  };
  const swatch = (k, line) => svg("svg", { class: "swatch", viewBox: "0 0 26 12", width: 26, height: 12, style: colours(k), "aria-hidden": "true" },
    line ? svg("path", { class: "line", d: "M1 6H25", "stroke-dasharray": data.styles[k].dash || undefined }) : null, marker(k, 13, 6, "point"));
  const heat = (f) => {
    const k = Math.min(RAMP.length - 2, Math.max(0, Math.floor(f * (RAMP.length - 1))));
    const w = Math.min(1, Math.max(0, f * (RAMP.length - 1) - k));
    const channel = (i) => Math.round(parseInt(RAMP[k].slice(i, i + 2), 16) * (1 - w) + parseInt(RAMP[k + 1].slice(i, i + 2), 16) * w);
    return `rgb(${channel(1)} ${channel(3)} ${channel(5)})`;
  };

  const verdict = (word) => (word ? html("span", { class: `verdict ${word === "agrees" ? "good" : /^(wrong|incons)/.test(word) ? "bad" : "unsure"}` }, word) : "");

  // ---- one panel

  let panels = 0;
  const panel = (state, facet, width, value) => {
    const { figure, table } = state;
    const [X, Y] = [figure.x[state.x], figure.y[state.y]];
    const chosen = figure.series.filter((s) => s.f === facet && !state.hidden.has(s.n));
    const points = [];
    for (const series of chosen) for (const row of series.r) {
      if (!kept(table, row)) continue;
      const x = table.column[series.x || X.c].values[row];
      const y = table.column[series.y || Y.c].values[row];
      if (x !== null && y !== null && !(X.scale === "log" && x < 0) && !(Y.scale === "log" && y < 0)) points.push({ series, row, x, y });
    }
    const about = figure.facets[facet];
    const guides = about.guides.filter((g) => !g.column || g.column === (g.axis === "x" ? X : Y).c);
    const id = `panel-${++panels}`;
    const node = html("div", { class: "panel" });
    if (about.name || value) node.append(html("h4", {}, [about.name, value && value.label].filter(Boolean).join(": "), verdict(about.verdict)));
    if (!points.length) {
      node.append(html("p", { class: "nothing" }, state.hidden.size || off.route.size || off.problem.size ? "Nothing to draw with these filters." : "Nothing to draw on these axes."));
      return node;
    }
    const bands = Y.scale === "category" ? bandsOf(points, figure.mark === "bars" ? 11 : 20, 8) : null;
    const extra = figure.interval ? points.flatMap((p) => figure.interval.map((c) => table.column[c].values[p.row])) : [];
    const view = state.views[`${facet}`] || {};
    const values = { x: [...points.map((p) => p.x), ...extra, ...guides.filter((g) => g.axis === "x").map((g) => g.value)], y: [...points.map((p) => p.y), ...guides.filter((g) => g.axis === "y").map((g) => g.value)] };
    if (figure.diagonal) values.x = values.y = [...values.x, ...values.y];
    if (figure.mark === "cells") for (const key of ["x", "y"]) {
      const half = gaps(points)[key] / 2;
      values[key] = values[key].flatMap((v) => [v - half, v + half]);
    }
    if (figure.mark === "bars" && !view.x) values.x.push(X.scale === "log" ? 0.8 : 0);
    const xs = scaleOf(X, values.x, view.x);
    const ys = bands || scaleOf(Y, values.y, view.y);
    const labels = Math.max(...ys.ticks.map((t) => t.label.length), 1);
    const left = Math.min(bands ? width * 0.42 : 80, 12 + labels * 6.6);
    const box = { left, top: bands ? 6 : 26, right: width - 14, bottom: 0 };
    const tall = bands ? bands.total : Math.min(400, Math.max(210, width * 0.56));
    box.bottom = box.top + tall;
    if (figure.mark === "cells") fit(box, xs, ys, values, width);
    const height = box.bottom + 42;
    const at = (p) => [box.left + xs.at(p.x) * (box.right - box.left), bands ? box.top + ys.at(p.y) * (box.bottom - box.top) : box.bottom - ys.at(p.y) * (box.bottom - box.top)];
    for (const p of points) [p.px, p.py] = at(p);
    const root = svg("svg", { viewBox: `0 0 ${width} ${height}`, width, height, role: "img", tabindex: 0, "aria-labelledby": `${id}-t ${id}-d`, class: figure.mark },
      svg("title", { id: `${id}-t` }, [figure.title, about.name].filter(Boolean).join(": ")),
      svg("desc", { id: `${id}-d` }, `${figure.says} ${about.says} ${points.length} points; arrow keys go from one to the next.`),
      svg("defs", {}, svg("clipPath", { id }, svg("rect", { x: box.left - 6, y: box.top - 6, width: box.right - box.left + 12, height: box.bottom - box.top + 12 })),
        svg("pattern", { id: `${id}-h`, width: 6, height: 6, patternUnits: "userSpaceOnUse", patternTransform: "rotate(45)" }, svg("path", { d: "M0 0V6", class: "hatch" }))));
    root.append(frame(box, xs, ys, X, Y, at, width, height, bands));
    const inside = svg("g", { "clip-path": `url(#${id})` });
    inside.append(...guides.map((g) => guide(g, box, at, xs, ys)));
    if (figure.diagonal) {
      const ends = [Math.max(xs.range[0], ys.range[0]), Math.min(xs.range[1], ys.range[1])].map((t) => at({ x: 10 ** t, y: 10 ** t }));
      inside.append(svg("path", { class: "guide", d: `M${ends.map((e) => e.map((v) => v.toFixed(1)).join(" ")).join("L")}` }));
    }
    const draw = { bars, ranges, cells, line: lines, points: lines }[figure.mark];
    inside.append(draw({ state, table, figure, points, chosen, box, at, value, facet, id }));
    root.append(inside);
    node.append(root);
    if (about.says) node.append(html("p", { class: "says" }, about.says));
    if (figure.mark === "cells") node.append(legendOfHeat(state, value, facet));
    listen(root, { state, facet, points, box, xs, ys, X, Y, bands, redraw: () => node.replaceWith(panel(state, facet, width, value)) });
    return node;
  };

  const fit = (box, xs, ys, values, width) => { // a cell is as high as it is wide
    const span = (v) => v.reduce((a, b) => Math.max(a, b)) - v.reduce((a, b) => Math.min(a, b));
    const shape = (span(values.y) || 1) / (span(values.x) || 1);
    const room = Math.min(width - box.left - 14, 340);
    const tall = Math.min(340, Math.max(60, room * shape));
    box.right = box.left + Math.min(room, tall / shape);
    box.bottom = box.top + tall;
  };

  const frame = (box, xs, ys, X, Y, at, width, height, bands) => {
    const g = svg("g", { class: "frame" });
    let end = -Infinity;
    for (const tick of xs.ticks) {
      const x = box.left + xs.at(tick.v) * (box.right - box.left);
      if (x < box.left - 1 || x > box.right + 1) continue;
      g.append(svg("path", { class: "grid", d: `M${x.toFixed(1)} ${box.top}V${box.bottom}` }));
      const half = tick.label.length * 3.3;
      if (x - half > end + 6) {
        g.append(svg("text", { x: x.toFixed(1), y: box.bottom + 16, "text-anchor": "middle" }, tick.label));
        end = x + half;
      }
    }
    for (const tick of ys.ticks) {
      const y = bands ? box.top + ys.at(tick.v) * (box.bottom - box.top) : box.bottom - ys.at(tick.v) * (box.bottom - box.top);
      if (y < box.top - 1 || y > box.bottom + 1) continue;
      if (!bands) g.append(svg("path", { class: "grid", d: `M${box.left} ${y.toFixed(1)}H${box.right}` }));
      const most = Math.floor((box.left - 8) / 6.2);
      const text = tick.label.length > most ? `${tick.label.slice(0, most - 1)}…` : tick.label;
      g.append(svg("text", { x: box.left - 7, y: y.toFixed(1), dy: "0.35em", "text-anchor": "end" }, text, text === tick.label ? null : svg("title", {}, tick.label)));
    }
    g.append(svg("path", { class: "axis", d: `M${box.left} ${box.top}V${box.bottom}H${box.right}` }));
    const titled = (axis) => (axis.unit && !(axis.unit in UNITS) ? `${axis.label} [${axis.unit}]` : axis.label);
    g.append(svg("text", { class: "label", x: box.right, y: box.bottom + 34, "text-anchor": "end" }, titled(X)));
    if (!bands) g.append(svg("text", { class: "label", x: 0, y: 11 }, titled(Y)));
    return g;
  };

  const guide = (g, box, at, xs, ys) => {
    if (g.axis === "x") {
      const x = box.left + xs.at(g.value) * (box.right - box.left);
      return svg("g", {}, svg("path", { class: "guide", d: `M${x.toFixed(1)} ${box.top}V${box.bottom}` }), svg("text", { class: "remark", x: x + 5, y: box.top + 10 }, g.label));
    }
    const y = box.bottom - ys.at(g.value) * (box.bottom - box.top);
    return svg("g", {}, svg("path", { class: "guide", d: `M${box.left} ${y.toFixed(1)}H${box.right}` }), svg("text", { class: "remark", x: box.left + 6, y: y - 5 }, g.label));
  };

  const lines = ({ table, figure, points, chosen, box, facet }) => {
    const g = svg("g", {});
    if (figure.front) g.append(fronts(table, points));
    for (const series of chosen) {
      const own = points.filter((p) => p.series === series);
      if (!own.length) continue;
      const group = svg("g", { style: colours(series.s), class: "series" });
      if (figure.mark === "line") group.append(svg("path", { class: "line", d: `M${own.map((p) => `${p.px.toFixed(1)} ${p.py.toFixed(1)}`).join("L")}`, "stroke-dasharray": data.styles[series.s].dash || undefined }));
      const dense = figure.mark === "line" && own.length * 9 > box.right - box.left;
      for (const p of own) {
        const blind = figure.hatched && table.column[figure.hatched].values[p.row];
        group.append(marker(series.s, p.px, p.py, blind ? "point faint" : "point", dense ? 0.5 : 1));
      }
      if (figure.note) for (const p of own) {
        const word = table.column[figure.note].values[p.row];
        if (word) group.append(svg("circle", { class: "ring", cx: p.px, cy: p.py, r: 8 }), svg("text", { class: "remark", x: p.px > box.right - 90 ? p.px - 11 : p.px + 11, "text-anchor": p.px > box.right - 90 ? "end" : "start", y: p.py - 7 }, word));
      }
      g.append(group);
    }
    return g;
  };

  const fronts = (table, points) => { // of each problem: what no other point beats on both axes
    const of = new Map();
    for (const p of points) {
      const name = table.column.problem.values[p.row];
      of.set(name, [...(of.get(name) || []), p]);
    }
    const g = svg("g", { class: of.size > 12 ? "fronts many" : "fronts" });
    for (const own of of.values()) {
      let best = Infinity;
      const front = own.sort((a, b) => a.x - b.x || a.y - b.y).filter((p) => p.y < best && ((best = p.y), true));
      if (front.length > 1) g.append(svg("path", { class: "front", d: `M${front.map((p) => `${p.px.toFixed(1)} ${p.py.toFixed(1)}`).join("L")}` }));
    }
    return g;
  };

  const bars = ({ points, box }) => {
    const g = svg("g", {});
    for (const p of points) {
      p.py += p.lane;
      const group = svg("g", { style: colours(p.series.s), class: "series" });
      group.append(svg("rect", { class: "bar", x: box.left, y: (p.py - 4.5).toFixed(1), width: Math.max(0, p.px - box.left).toFixed(1), height: 9 }));
      const text = digits(p.x, 3);
      const tight = p.px + text.length * 6.5 + 8 > box.right;
      group.append(svg("text", { class: tight ? "count within" : "count", x: tight ? p.px - 4 : p.px + 4, y: p.py, dy: "0.35em", "text-anchor": tight ? "end" : "start" }, text));
      g.append(group);
    }
    return g;
  };

  const ranges = ({ table, figure, points, at, box }) => {
    const g = svg("g", {});
    for (const p of points) {
      p.py += p.lane;
      const ends = figure.interval.map((c) => table.column[c].values[p.row]);
      const [from, to] = ends.map((v, k) => (v === null || (figure.x[0].scale === "log" && v <= 0) ? (k ? box.right : box.left) : at({ x: v, y: p.y })[0]));
      const group = svg("g", { style: colours(p.series.s), class: "series" });
      if (ends.some((v) => v !== null)) group.append(svg("path", { class: "line", d: `M${from.toFixed(1)} ${p.py.toFixed(1)}H${to.toFixed(1)}` }));
      group.append(marker(p.series.s, p.px, p.py, "point"));
      g.append(group);
    }
    return g;
  };

  const extent = (state, facet) => { // one scale for all values of a run, so that they compare
    const { figure, table } = state;
    const run = figure.series.find((s) => s.f === facet).n;
    const rows = figure.series.filter((s) => s.n === run).flatMap((s) => s.r);
    const values = figure.values.flatMap((v) => rows.map((row) => table.column[v.c].values[row])).filter((v) => v !== null);
    return [values.reduce((a, b) => Math.min(a, b), Infinity), values.reduce((a, b) => Math.max(a, b), -Infinity)];
  };
  const gaps = (points) => { // sides of a cell: of the grid that points lie on, else of as many equal squares
    const unique = (key) => [...new Set(points.map((p) => Number(p[key].toPrecision(9))))].sort((a, b) => a - b);
    const [ux, uy] = [unique("x"), unique("y")];
    const gap = (u) => (u.length > 1 ? u.slice(1).reduce((least, v, k) => Math.min(least, v - u[k]), Infinity) : null);
    const spread = (u) => u.at(-1) - u[0] || 1;
    const side = Math.sqrt((spread(ux) * spread(uy)) / points.length);
    const grid = ux.length * uy.length <= 4 * points.length;
    return grid ? { x: gap(ux) || gap(uy) || 1, y: gap(uy) || gap(ux) || 1 } : { x: side, y: side };
  };
  const cells = ({ state, table, figure, points, at, value, facet, id }) => {
    const g = svg("g", { class: "series" });
    const [low, high] = extent(state, facet);
    const { x: dx, y: dy } = gaps(points);
    for (const p of points) {
      const [a, b] = [at({ x: p.x - dx / 2, y: p.y - dy / 2 }), at({ x: p.x + dx / 2, y: p.y + dy / 2 })];
      const shape = { x: a[0].toFixed(1), y: b[1].toFixed(1), width: (b[0] - a[0]).toFixed(1), height: (a[1] - b[1]).toFixed(1) };
      const v = table.column[value.c].values[p.row];
      const blind = figure.hatched && table.column[figure.hatched].values[p.row];
      g.append(svg("rect", { class: "cell", ...shape, style: v === null ? undefined : `fill:${heat(high > low ? (v - low) / (high - low) : 0.5)}` }));
      if (blind) g.append(svg("rect", { ...shape, class: "blind", fill: `url(#${id}-h)` }));
    }
    return g;
  };
  const legendOfHeat = (state, value, facet) => {
    const [low, high] = extent(state, facet);
    return html("p", { class: "heat" }, digits(low, 3), html("span", { style: `background:linear-gradient(90deg, ${RAMP.join(",")})` }), digits(high, 3));
  };

  // ---- pointing, zooming

  const tip = document.body.appendChild(html("div", { class: "tip", role: "status", hidden: "" }));
  const tell = (plot, p, root) => {
    const { table, figure } = plot.state;
    const first = [p.series.x || plot.X.c, p.series.y || plot.Y.c];
    const names = [...new Set([...first, ...(figure.values || []).map((v) => v.c), "problem", "route", ...table.columns.map((c) => c.name)])];
    const known = names.map((name) => table.column[name]).filter((c) => c && c.values[p.row] !== null && String(c.values[p.row]).length < 90);
    tip.replaceChildren(html("b", {}, p.series.n), html("dl", {}, ...known.slice(0, 10).flatMap((c) => [html("dt", {}, c.name.replace(/_/g, " ")), html("dd", {}, shown(c, c.values[p.row]))])));
    tip.hidden = false;
    const frame = root.getBoundingClientRect();
    const x = frame.left + (p.px * frame.width) / root.viewBox.baseVal.width;
    const y = frame.top + (p.py * frame.height) / root.viewBox.baseVal.height;
    tip.style.left = `${Math.max(8, Math.min(window.innerWidth - tip.offsetWidth - 8, x + 14)) + window.scrollX}px`;
    tip.style.top = `${(y + tip.offsetHeight + 20 > window.innerHeight ? y - tip.offsetHeight - 12 : y + 14) + window.scrollY}px`;
    root.querySelector(".halo")?.remove();
    root.append(svg("circle", { class: "halo", cx: p.px, cy: p.py, r: 8 }));
  };
  const listen = (root, plot) => {
    const { state, facet, points, box } = plot;
    const where = (event) => {
      const frame = root.getBoundingClientRect();
      return [((event.clientX - frame.left) * root.viewBox.baseVal.width) / frame.width, ((event.clientY - frame.top) * root.viewBox.baseVal.height) / frame.height];
    };
    const clear = () => { tip.hidden = true; root.querySelector(".halo")?.remove(); };
    const wide = state.figure.mark === "bars" || state.figure.mark === "ranges" ? 0.1 : 1;
    const nearest = ([x, y]) => points.reduce((best, p) => {
      const d = Math.hypot((p.px - x) * wide, p.py - y);
      return d < best.d ? { d, p } : best;
    }, { d: REACH, p: null }).p;
    const zoom = (x, y) => {
      const view = { x: x.map((px) => plot.xs.back((px - box.left) / (box.right - box.left))) };
      if (!plot.bands) view.y = y.map((py) => plot.ys.back((box.bottom - py) / (box.bottom - box.top)));
      state.views[`${facet}`] = view;
      clear();
      state.reset.hidden = false;
      plot.redraw();
    };
    const about = ([x, y], factor) => zoom([x + (box.left - x) * factor, x + (box.right - x) * factor], [y + (box.bottom - y) * factor, y + (box.top - y) * factor]);
    let start = null;
    let rubber = null;
    root.addEventListener("pointerdown", (event) => {
      if (event.pointerType === "touch" || event.button) return;
      start = where(event);
      root.setPointerCapture(event.pointerId);
    });
    root.addEventListener("pointermove", (event) => {
      const now = where(event);
      if (start && Math.hypot(now[0] - start[0], now[1] - start[1]) > 5) {
        rubber = rubber || root.appendChild(svg("rect", { class: "rubber" }));
        for (const [key, k, size] of [["x", 0, "width"], ["y", 1, "height"]]) {
          rubber.setAttribute(key, Math.min(start[k], now[k]));
          rubber.setAttribute(size, Math.abs(start[k] - now[k]));
        }
        return;
      }
      const p = nearest(now);
      if (p) tell(plot, p, root); else clear();
    });
    root.addEventListener("pointerup", (event) => {
      const [from, to] = [start, where(event)];
      start = null;
      if (!rubber) return;
      rubber.remove();
      rubber = null;
      const [x, y] = [0, 1].map((k) => [from[k], to[k]].sort((a, b) => a - b));
      if (x[1] - x[0] > 8 && (plot.bands || y[1] - y[0] > 8)) zoom(x, [y[1], y[0]]);
    });
    root.addEventListener("pointerleave", clear);
    root.addEventListener("blur", clear);
    root.addEventListener("dblclick", () => resetZoom(state));
    root.addEventListener("wheel", (event) => { // plain scrolling stays the page's until a figure was clicked
      if (!(event.ctrlKey || document.activeElement === root)) return;
      event.preventDefault();
      about(where(event), event.deltaY < 0 ? 0.8 : 1.25);
    }, { passive: false });
    let k = -1;
    root.addEventListener("keydown", (event) => {
      const step = { ArrowRight: 1, ArrowDown: 1, ArrowLeft: -1, ArrowUp: -1 }[event.key];
      const middle = [(box.left + box.right) / 2, (box.top + box.bottom) / 2];
      if (step) tell(plot, points[(k = (k + step + points.length) % points.length)], root);
      else if (event.key === "+") about(middle, 0.8);
      else if (event.key === "-") about(middle, 1.25);
      else if (event.key === "0") resetZoom(state);
      else if (event.key === "Escape") clear();
      else return;
      event.preventDefault();
    });
  };
  const resetZoom = (state) => {
    state.views = {};
    state.reset.hidden = true;
    drawFigure(state);
  };

  // ---- a figure: tools, legend, panels, numbers

  const states = [...document.querySelectorAll("[data-figure]")].map((node) => {
    const figure = data.figures[Number(node.dataset.figure)];
    return { node, figure, table: tables[figure.t], x: 0, y: 0, views: {}, hidden: new Set(), all: false, allRows: false, sort: null, drawn: false };
  });

  const tools = (state) => {
    const { figure, node } = state;
    const bar = node.querySelector(".tools");
    for (const key of ["x", "y"]) if (figure[key].length > 1) {
      const select = html("select", { "aria-label": `${key} axis of ${figure.title}` }, ...figure[key].map((axis, k) => html("option", { value: k }, axis.label)));
      select.addEventListener("change", () => { state[key] = Number(select.value); state.views = {}; drawFigure(state); });
      bar.append(html("label", {}, `${key} `, select));
    }
    if (figure.series.length) {
      state.reset = button("Reset zoom", () => resetZoom(state), { hidden: "" });
      state.toggle = button("Table", () => { state.open = !state.open; state.toggle.setAttribute("aria-expanded", state.open); numbers(state); }, { "aria-expanded": "false" });
      bar.append(state.reset, state.toggle);
    } else state.open = true;
    bar.append(button("CSV", () => download(`${figure.id}.csv`, csv(state)), { title: "All numbers of this figure, filters applied" }));
  };

  const legend = (state) => {
    const { figure, table, node } = state;
    const names = new Map();
    for (const s of figure.series) if (figure.mark !== "cells" && s.r.some((row) => kept(table, row))) if (!names.has(s.n)) names.set(s.n, s.s);
    node.querySelector(".legend").replaceChildren(...(names.size > 1 ? [...names] : []).map(([name, style]) =>
      button(name, () => { if (!state.hidden.delete(name)) state.hidden.add(name); drawFigure(state); }, { "aria-pressed": !state.hidden.has(name), title: "Click to hide or show" })));
    [...node.querySelectorAll(".legend button")].forEach((b, k) => b.prepend(swatch([...names.values()][k], figure.mark === "line")));
  };

  const drawFigure = (state) => {
    state.drawn = true;
    const { figure, table, node } = state;
    if (figure.series.length) {
      legend(state);
      const area = node.querySelector(".panels");
      const wanted = figure.facets.map((_, k) => k).filter((k) => figure.series.some((s) => s.f === k && s.r.some((row) => kept(table, row))));
      const values = figure.mark === "cells" ? figure.values.filter((v) => table.column[v.c].values.some((w) => w !== null)) : [null];
      const room = node.clientWidth || 700;
      const small = figure.mark === "cells";
      const columns = Math.min(wanted.length * values.length, room >= 640 ? (small ? 4 : 2) : small && room >= 300 ? 2 : 1);
      area.style.setProperty("--columns", columns);
      area.classList.toggle("small", small);
      const width = Math.floor(Math.min(1040, (room - (columns - 1) * (columns > 2 || room < 640 ? 16 : 28)) / columns));
      const some = state.all ? wanted : wanted.slice(0, FIRST);
      area.replaceChildren(...some.flatMap((k) => values.map((value) => panel(state, k, width, value))));
      if (!wanted.length) area.append(html("p", { class: "nothing" }, "Nothing to draw with these filters."));
      if (some.length < wanted.length) area.append(button(`Show all ${wanted.length} panels`, () => { state.all = true; drawFigure(state); }, { class: "more" }));
    }
    numbers(state);
  };

  const numbers = (state) => {
    const area = state.node.querySelector(".numbers");
    if (!state.open) return area.replaceChildren();
    const columns = columnsOf(state).filter((c) => c.values.some((v) => v !== null));
    let rows = rowsOf(state);
    const by = state.sort && state.table.column[state.sort.name];
    if (by) rows = rows.sort((a, b) => state.sort.way * compare(by.values[a], by.values[b]));
    const some = state.allRows ? rows : rows.slice(0, ROWS);
    const heads = columns.map((c) => {
      const sorted = state.sort && state.sort.name === c.name;
      const head = button(c.name.replace(/_/g, " "), () => { state.sort = { name: c.name, way: sorted ? -state.sort.way : 1 }; numbers(state); }, { title: c.meaning });
      return html("th", { scope: "col", class: c.number ? "number" : "", "aria-sort": sorted ? (state.sort.way > 0 ? "ascending" : "descending") : undefined }, head, c.unit && c.unit !== "1" ? html("i", {}, c.unit) : "");
    });
    const lines = some.map((row) => html("tr", {}, ...columns.map((c) => html("td", { class: c.number ? "number" : String(c.values[row] || "").length > 40 ? "long" : "" }, c.name === "verdict" ? verdict(c.values[row]) : shown(c, c.values[row])))));
    return area.replaceChildren(
      html("div", { class: "scroll", tabindex: 0, role: "region", "aria-label": `Numbers of ${state.figure.title}` }, html("table", {}, html("thead", {}, html("tr", {}, ...heads)), html("tbody", {}, ...lines))),
      some.length < rows.length ? button(`Show all ${rows.length} rows`, () => { state.allRows = true; numbers(state); }, { class: "more" }) : "");
  };
  const compare = (a, b) => (a === b ? 0 : a === null ? 1 : b === null ? -1 : a < b ? -1 : 1);

  const csv = (state) => {
    const quote = (v) => (v === null ? "" : /[",\r\n]/.test(String(v)) ? `"${String(v).replace(/"/g, '""')}"` : String(v));
    const columns = columnsOf(state);
    const head = columns.map((c) => quote(c.unit && c.unit !== "1" ? `${c.name} [${c.unit}]` : c.name));
    return [head, ...rowsOf(state).map((row) => columns.map((c) => quote(c.values[row])))].map((cells) => `${cells.join(",")}\r\n`).join("");
  };
  const download = (name, text) => {
    const url = URL.createObjectURL(new Blob([text], { type: "text/csv;charset=utf-8" }));
    html("a", { href: url, download: name }).click();
    setTimeout(() => URL.revokeObjectURL(url), 1000);
  };

  // ---- filters for all figures

  const filtered = () => {
    for (const state of states) if (state.drawn) drawFigure(state);
    for (const note of document.querySelectorAll("details[data-problem]")) note.hidden = off.problem.has(selector(note.dataset.problem)) || off.route.has(bare(note.dataset.route));
    chips();
  };
  const toggle = (set, names) => {
    const on = names.every((name) => !set.has(name));
    for (const name of names) if (on) set.add(name); else set.delete(name);
    filtered();
  };
  const chips = () => {
    const count = problems.filter((p) => !off.problem.has(p)).length;
    const summary = document.querySelector(".problems summary");
    if (summary) summary.textContent = count === problems.length ? `All ${count} problems` : `${count} of ${problems.length} problems`;
    for (const chip of document.querySelectorAll(".chip")) chip.setAttribute("aria-pressed", !off.route.has(chip.dataset.name));
    for (const box of document.querySelectorAll(".problems input")) {
      const names = box.dataset.family ? problems.filter((p) => bare(p) === box.dataset.family) : [box.value];
      box.checked = names.some((name) => !off.problem.has(name));
      box.indeterminate = box.checked && names.some((name) => off.problem.has(name));
    }
    document.querySelector(".clear").hidden = !(off.problem.size + off.route.size);
  };
  const filters = () => {
    const bar = document.querySelector(".filters");
    for (const { name, s } of data.routes) {
      const chip = button(name, () => toggle(off.route, [name]), { class: "chip", "data-name": name, "aria-pressed": "true", title: "Click to hide or show this route everywhere" });
      chip.prepend(swatch(s, false));
      bar.append(chip);
    }
    if (problems.length > 1) {
      const list = html("div", { class: "list" });
      const box = (text, names, family) => {
        const input = html("input", { type: "checkbox", value: text, checked: "", "data-family": family });
        input.addEventListener("change", () => toggle(off.problem, input.checked ? names.filter((name) => off.problem.has(name)) : names.filter((name) => !off.problem.has(name))));
        return html("label", { class: family ? "family" : "" }, input, ` ${text}`);
      };
      for (const family of new Set(problems.map(bare))) {
        const names = problems.filter((p) => bare(p) === family);
        if (names.length > 1) list.append(box(`all of ${family}`, names, family));
        list.append(...names.map((name) => box(name, [name])));
      }
      bar.append(html("details", { class: "problems" }, html("summary", {}), list));
    }
    bar.append(button("Show everything", () => { off.problem.clear(); off.route.clear(); filtered(); }, { class: "clear" }));
    bar.hidden = !(data.routes.length || problems.length > 1);
    chips();
  };

  // ---- begin: figure after figure, so that the first is there at once

  filters();
  for (const state of states) tools(state);
  const drawAll = () => { for (const state of states) if (!state.drawn) drawFigure(state); };
  const next = () => {
    const state = states.find((s) => !s.drawn);
    if (!state) return;
    drawFigure(state);
    setTimeout(next);
  };
  next();
  let wide = window.innerWidth;
  window.addEventListener("resize", () => {
    if (window.innerWidth === wide) return;
    wide = window.innerWidth;
    for (const state of states) if (state.drawn) drawFigure(state);
  });
  window.addEventListener("beforeprint", drawAll);
  document.addEventListener("click", (event) => {
    const open = document.querySelector(".problems[open]");
    if (open && !open.contains(event.target)) open.open = false;
  });
  window.report = { data, states, tables, off, drawAll, filtered, csv, kept };
})();
