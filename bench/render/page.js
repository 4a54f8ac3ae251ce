// The page: tools, legends and tables of figures, filters for all of them.
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
  [...node.querySelectorAll(".legend button")].forEach((b, k) => b.prepend(swatch([...names.values()][k], figure.mark)));
};

const valuesOf = ({ figure, table }, facet) => // those that cells of a panel are coloured by
  figure.mark === "cells" ? figure.values.filter((v) => figure.series.some((s) => s.f === facet && s.r.some((row) => table.column[v.c].values[row] !== null))) : [null];

const drawFigure = (state) => {
  state.drawn = true;
  const { figure, table, node } = state;
  if (figure.series.length) {
    legend(state);
    const area = node.querySelector(".panels");
    const wanted = figure.facets.map((_, k) => k).filter((k) => figure.series.some((s) => s.f === k && s.r.some((row) => kept(table, row))));
    const room = node.clientWidth || 700;
    const small = figure.mark === "cells";
    const count = wanted.reduce((sum, k) => sum + valuesOf(state, k).length, 0);
    const columns = Math.min(count, room >= 640 ? (small ? 4 : 2) : small && room >= 300 ? 2 : 1);
    area.style.setProperty("--columns", columns);
    area.classList.toggle("small", small);
    const width = Math.floor(Math.min(1040, (room - (columns - 1) * (columns > 2 || room < 640 ? 16 : 28)) / columns));
    const some = state.all ? wanted : wanted.slice(0, FIRST);
    area.replaceChildren(...some.flatMap((k) => valuesOf(state, k).map((value) => panel(state, k, width, value))));
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
    chip.prepend(swatch(s, "points"));
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
