"use strict";
(() => {
  const all = (css, root = document) => [...root.querySelectorAll(css)];
  const one = (css, root = document) => root.querySelector(css);

  // light and dark: the system's choice until the button is pressed
  const theme = one("#theme");
  const dark = () => (document.documentElement.dataset.theme || (matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light")) === "dark";
  const said = () => { theme.textContent = dark() ? "Light" : "Dark"; };
  theme.hidden = false;
  theme.addEventListener("click", () => { document.documentElement.dataset.theme = dark() ? "light" : "dark"; said(); });
  said();

  // models on and off, in every picture
  for (const box of all(".switches input")) {
    const follow = () => {
      for (const part of all("[data-series]")) if (part.dataset.series === box.value) part.classList.toggle("off", !box.checked);
    };
    box.addEventListener("change", follow);
    follow();
  }

  // one recording's history at a time
  const histories = all(".run"), chooser = one("#recording");
  const show = (index) => {
    histories.forEach((run, k) => { run.hidden = k !== index; });
    chooser.selectedIndex = index;
  };
  const open = (name) => {
    const index = histories.findIndex((run) => run.dataset.recording === name);
    if (index >= 0) show(index);
    return index >= 0;
  };
  if (chooser) {
    chooser.addEventListener("change", () => show(chooser.selectedIndex));
    const step = (by) => () => show((chooser.selectedIndex + by + histories.length) % histories.length);
    one("#before").addEventListener("click", step(-1));
    one("#after").addEventListener("click", step(1));
    show(0);
  }
  const visit = (name) => { if (open(name)) { one("#history").scrollIntoView(); chooser.focus({ preventScroll: true }); } };
  document.addEventListener("click", (event) => {
    const link = event.target.closest("[data-visit]");
    if (link) { event.preventDefault(); visit(link.dataset.visit); }
  });

  // values under the cursor of a history, read back from the drawing: lines of M x y, then steps from corner to corner
  const linesOf = (path) => [...path.getAttribute("d").matchAll(/M([^M]*)/g)].map(([, rest]) => {
    const numbers = rest.match(/-?[\d.]+/g).map(Number);
    let [x, y] = numbers;
    const corners = [[x, y]];
    for (let k = 2; k + 1 < numbers.length; k += 2) { x += numbers[k]; y += numbers[k + 1]; corners.push([x, y]); }
    return corners;
  });
  const placeAt = (path, at) => {  // height on the drawing, and whether it is only that of the corner before a gap
    path.lines = path.lines || linesOf(path);
    let before = path.lines.length ? path.lines[0][0] : [at, NaN];
    for (const line of path.lines) {
      if (line[0][0] > at) return [before[1], line !== path.lines[0]];
      for (const corner of line) {
        if (corner[0] > at) return [before[1] + (at - before[0]) / (corner[0] - before[0]) * (corner[1] - before[1]), false];
        before = corner;
      }
    }
    return [before[1], false];
  };
  const valueAt = (path, at, bottom, top, least, most) => {
    const [y, gap] = path ? placeAt(path, at) : [NaN, true];
    if (y < top - 1) return `> ${most.toPrecision(3)}`;  // the drawing ends near its panel
    if (y > bottom + 1) return `< ${least.toPrecision(3)}`;
    return gap || Number.isNaN(y) ? "none" : (least + (bottom - y) / (bottom - top) * (most - least)).toPrecision(3);
  };
  const cursorOf = (svg, panels) => {
    if (!one(".cursor", svg)) {
      const line = document.createElementNS("http://www.w3.org/2000/svg", "line");
      line.setAttribute("class", "cursor");
      line.setAttribute("y1", panels[0][6]);
      line.setAttribute("y2", panels[panels.length - 1][5]);
      svg.append(line);
    }
    return one(".cursor", svg);
  };
  const read = (svg, x) => {
    const panels = JSON.parse(svg.dataset.panels);
    const [, left, right, low, high] = panels[0];
    const at = Math.min(Math.max(x, left), right);
    cursorOf(svg, panels).setAttribute("transform", `translate(${at},0)`);
    const words = [`${(low + (at - left) / (right - left) * (high - low)).toFixed(2)} s`];
    panels.forEach(([label, , , , , ...up], k) => {
      const curves = all(`[data-curve="${k}"]:not(.off)`, svg);
      const values = curves.map((curve) => `${curve.dataset.series} ${valueAt(one("path", curve), at, ...up)}`);
      if (values.length) words.push(`${label}: ${values.join(", ")}`);
    });
    svg.cursorAt = at;
    svg.closest(".run").querySelector(".read").textContent = words.join("; ");
  };
  for (const svg of all("svg.history:not(.steady)")) {
    svg.addEventListener("pointermove", (event) => {
      const box = svg.getBoundingClientRect();
      read(svg, (event.clientX - box.left) * svg.viewBox.baseVal.width / box.width);
    });
    svg.addEventListener("keydown", (event) => {
      const by = { ArrowLeft: -6, ArrowRight: 6, PageUp: -60, PageDown: 60 }[event.key];
      if (by) { event.preventDefault(); read(svg, (svg.cursorAt || 62) + by); }
    });
  }

  // residual maps: choose one; a cell says who fills it
  const maps = all(".map");
  const choice = () => ["joint", "over", "model"].map((id) => one(`#map-${id}`).value).join("|");
  const detail = one("#cell");
  const tell = (cell) => {
    const map = cell.closest(".map"), row = cell.parentElement;
    const across = one("thead tr:last-child", map).children[cell.cellIndex].textContent, down = row.cells[0].textContent;
    detail.replaceChildren();
    const head = document.createElement("p");
    head.textContent = cell.textContent === "" ? `${map.dataset.across} ${across}, ${map.dataset.down} ${down}: too few rows.`
      : `${map.dataset.across} ${across}, ${map.dataset.down} ${down}: residual ${cell.textContent.replace(/^[+\u2212]/, "")} N m rms, mean ${cell.dataset.mean} N m, ${cell.dataset.rows} rows. Filled by:`;
    detail.append(head);
    const list = document.createElement("ul");
    for (const [name, share] of JSON.parse(cell.dataset.by || "[]")) {
      const item = document.createElement("li"), button = document.createElement("button");
      button.textContent = `${name} (${Math.round(100 * share)} %)`;
      button.dataset.visit = name;
      item.append(button);
      list.append(item);
    }
    detail.append(list);
  };
  const bring = () => maps.forEach((map) => { map.hidden = map.dataset.key !== choice(); });
  if (maps.length) {
    all("#map-joint, #map-over, #map-model").forEach((select) => select.addEventListener("change", bring));
    bring();
    for (const map of maps) {
      const cells = all("tbody td", map);
      if (cells.length) cells[0].tabIndex = 0;
      for (const cell of cells) {
        cell.addEventListener("pointerenter", () => tell(cell));
        cell.addEventListener("focus", () => tell(cell));
        cell.addEventListener("click", () => cell.focus());
      }
      map.addEventListener("keydown", (event) => {
        const move = { ArrowLeft: [0, -1], ArrowRight: [0, 1], ArrowUp: [-1, 0], ArrowDown: [1, 0] }[event.key];
        const cell = event.target.closest("td");
        if (!cell) return;
        if (event.key === "Enter") { event.preventDefault(); const first = one("button", detail); if (first) first.focus(); return; }
        if (!move) return;
        event.preventDefault();
        const rows = all("tbody tr", map), row = rows.indexOf(cell.parentElement) + move[0];
        const next = rows[row] && rows[row].cells[cell.cellIndex + move[1]];
        if (next && next.tagName === "TD") { cells.forEach((c) => { c.tabIndex = -1; }); next.tabIndex = 0; next.focus(); }
      });
    }
  }
  // what scrolls sideways can be reached by the keyboard
  const reachable = () => all("figure, .wide").forEach((box) => {
    if (box.scrollWidth > box.clientWidth) box.tabIndex = 0; else box.removeAttribute("tabindex");
  });
  addEventListener("resize", reachable);
  document.addEventListener("toggle", reachable, true);
  reachable();
  document.documentElement.dataset.ready = "yes";
})();
