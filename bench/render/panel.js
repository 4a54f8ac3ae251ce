// One panel: marks in their places, told about when pointed at, zoomed.
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
const swatch = (k, mark) => svg("svg", { class: "swatch", viewBox: "0 0 26 12", width: 26, height: 12, style: colours(k), "aria-hidden": "true" },
  mark === "line" ? svg("path", { class: "line", d: "M1 6H25", "stroke-dasharray": data.styles[k].dash || undefined }) : null,
  mark === "bars" ? svg("rect", { class: "bar", x: 2, y: 2, width: 22, height: 8 }) : marker(k, 13, 6, "point"));
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
  if (figure.mark === "cells") ["x", "y"].forEach((key, k) => { values[key] = values[key].flatMap((v) => [v - about.cell[k] / 2, v + about.cell[k] / 2]); });
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
  listen(root, { state, facet, points, box, xs, ys, X, Y, bands, redraw: () => again(state, facet, width, value, node, root) });
  return node;
};

const again = (state, facet, width, value, node, root) => { // zoomed; what had the focus keeps it
  const focused = document.activeElement === root;
  const next = panel(state, facet, width, value);
  node.replaceWith(next);
  if (focused) next.querySelector("svg")?.focus({ preventScroll: true });
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
  if (!values.length) return [0, 0];
  return [values.reduce((a, b) => Math.min(a, b), Infinity), values.reduce((a, b) => Math.max(a, b), -Infinity)];
};
const cells = ({ state, table, figure, points, at, value, facet, id }) => {
  const g = svg("g", { class: "series" });
  const [low, high] = extent(state, facet);
  const [dx, dy] = figure.facets[facet].cell;
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
  root.addEventListener("pointercancel", () => { start = null; rubber?.remove(); rubber = null; });
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
