"use strict";
// Draws the figures of a page, filters them and their tables, sorts tables, hands out their numbers.
(() => {
  const data = JSON.parse(document.getElementById("data").textContent);
  const ERRORS = 1; // of Vega, no warnings
  const night = matchMedia("(prefers-color-scheme: dark)").matches;
  const off = { problem: new Set(), route: new Set() };
  const bare = (text) => (/^[^[,]+/.exec(text ?? "") || [""])[0];
  const selector = (text) => (/^[^[,]+(\[[^\]]*\])?/.exec(text ?? "") || [""])[0];
  const kept = (row) => !(off.problem.has(selector(row.problem)) || off.route.has(bare(row.route)));
  const values = (column) => (Array.isArray(column) ? column : column.at.map((k) => column.of[k]));

  const figures = [...document.querySelectorAll("[data-figure]")].map((node) => {
    const figure = data.figures[node.dataset.figure];
    const columns = [...figure.columns.map(([name], k) => [name, values(figure.data[k])]),
      ...Object.entries(figure.drawn || {}).map(([name, column]) => [name, values(column)])];
    const blank = figure.specs ? { _panel: "", _series: "" } : {};
    const rows = Array.from({ length: columns.length ? columns[0][1].length : 0 }, (_, k) =>
      Object.assign({}, blank, Object.fromEntries(columns.map(([name, column]) => [name, column[k]]))));
    return { ...figure, node, rows, x: 0, y: 0, all: false };
  });

  // ---- drawing

  const shown = (figure) => { // the rows of the panels that are shown, and the guides there
    const rows = figure.rows.filter(kept);
    const panels = [...new Set(rows.map((row) => row._panel))];
    const there = new Set(figure.all ? panels : panels.slice(0, data.first));
    return [...rows, ...figure.guides].filter((row) => there.has(row._panel));
  };
  const fitted = (figure) => { // to the width there is, in the colours of the hour
    let text = JSON.stringify(figure.specs[figure.x][figure.y]);
    if (night) text = text.replace(/#[0-9a-f]{6}/gi, (colour) => data.night[colour.toLowerCase()] || colour);
    const spec = JSON.parse(text);
    const inner = spec.spec || spec;
    const room = figure.node.clientWidth || 900;
    if (spec.spec) spec.columns = Math.max(1, Math.min(spec.columns, Math.floor(room / (inner.width + 60))));
    inner.width = Math.min(inner.width, Math.max(140, room - 90));
    if (room < 640) spec.config.legend.columns = 1;
    return spec;
  };
  const draw = async (figure) => {
    const plot = figure.node.querySelector(".plot");
    const rows = shown(figure);
    plot.classList.toggle("night", night);
    if (!rows.length) return plot.replaceChildren("Nothing to draw with these filters.");
    const options = { actions: false, ast: true, renderer: "svg", logLevel: ERRORS, tooltip: { theme: night ? "dark" : "light" } };
    figure.drawing = vegaEmbed(plot, { ...fitted(figure), datasets: { rows } }, options);
    return figure.drawing;
  };
  const drawAll = async () => { // also what nobody has scrolled to
    for (const figure of figures) if (figure.specs) await (figure.drawing || draw(figure));
  };
  const watch = new IntersectionObserver((changes) => {
    for (const { isIntersecting, target } of changes) {
      const figure = figures[target.dataset.figure];
      if (isIntersecting && !figure.drawing) draw(figure);
    }
  }, { rootMargin: "600px" });
  const again = (figure) => { // when it is seen next, which may be now
    figure.drawing?.then((drawn) => drawn.finalize());
    figure.drawing = undefined;
    watch.unobserve(figure.node);
    watch.observe(figure.node);
  };

  // ---- numbers

  const table = (figure) => { // made when it is asked for
    const there = figure.node.querySelector(".numbers noscript");
    if (there) there.outerHTML = there.textContent;
    const made = figure.node.querySelector(".numbers table");
    if (figure.table || !made) return;
    figure.table = made;
    [...made.tBodies[0].rows].forEach((tr, k) => { tr.place = k; });
    [...made.tHead.rows[0].cells].forEach((th, k) => {
      const name = figure.columns[figure.known[k]][0];
      const sort = Object.assign(document.createElement("button"), { type: "button" });
      sort.append(...th.childNodes);
      th.append(sort);
      sort.addEventListener("click", () => {
        const way = th.ariaSort === "ascending" ? -1 : 1;
        for (const other of th.parentNode.cells) other.ariaSort = null;
        th.ariaSort = way > 0 ? "ascending" : "descending";
        const of = (tr) => figure.rows[tr.place][name];
        const compare = (a, b) => (a === b ? 0 : a === null ? 1 : b === null ? -1 : a < b ? -way : way);
        made.tBodies[0].append(...[...made.tBodies[0].rows].sort((a, b) => compare(of(a), of(b))));
      });
    });
    filterTable(figure);
  };
  const filterTable = (figure) => {
    for (const tr of figure.table?.rows || []) {
      if (tr.place !== undefined) tr.hidden = !kept(figure.rows[tr.place]);
      [...tr.cells].forEach((cell, k) => { cell.hidden = off.route.has(figure.columns[figure.known[k]][0]); });
    }
  };
  const csv = (figure) => {
    const quote = (v) => (v === null ? "" : /[",\r\n]/.test(v) ? `"${String(v).replace(/"/g, '""')}"` : String(v));
    const columns = figure.columns.filter(([name]) => !off.route.has(name));
    const head = columns.map(([name, unit]) => quote(unit && unit !== "1" ? `${name} [${unit}]` : name));
    const lines = figure.rows.filter(kept).map((row) => columns.map(([name]) => quote(row[name])));
    return [head, ...lines].map((cells) => `${cells.join(",")}\r\n`).join("");
  };
  const download = (name, text) => {
    const url = URL.createObjectURL(new Blob([text], { type: "text/csv;charset=utf-8" }));
    Object.assign(document.createElement("a"), { href: url, download: name }).click();
    setTimeout(() => URL.revokeObjectURL(url), 1000);
  };

  // ---- filters for all figures

  const filters = document.querySelector(".filters");
  const filtered = () => {
    for (const kind of ["problem", "route"]) {
      off[kind] = new Set([...filters.querySelectorAll(`[name=${kind}]:not(:checked)`)].map((box) => box.value));
    }
    for (const note of document.querySelectorAll("details.note")) note.hidden = !kept(note.dataset);
    for (const figure of figures) {
      filterTable(figure);
      if (figure.specs) again(figure);
    }
  };
  filters.addEventListener("change", ({ target }) => {
    if (target.name === "family") {
      for (const box of filters.querySelectorAll("[name=problem]")) if (bare(box.value) === target.value) box.checked = target.checked;
    }
    filtered();
  });
  filters.hidden = !filters.children.length;

  // ---- begin

  for (const figure of figures) {
    const tools = figure.node.querySelector(".tools");
    tools.hidden = false;
    tools.addEventListener("change", ({ target }) => { figure[target.dataset.axis] = Number(target.value); again(figure); });
    tools.addEventListener("click", ({ target }) => {
      if (target.dataset.do === "csv") download(`${figure.id}.csv`, csv(figure));
      if (target.dataset.do === "all") { figure.all = true; target.hidden = true; again(figure); }
    });
    const numbers = figure.node.querySelector(".numbers details");
    if (numbers) numbers.addEventListener("toggle", () => table(figure)); else table(figure);
    if (figure.specs) watch.observe(figure.node);
  }
  addEventListener("beforeprint", drawAll);
  window.report = { figures, csv, table, filtered, draw, drawAll };
})();
