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

  // values under the cursor of a history, read back from the drawing
  const points = (path) => {
    const [, x0, y0, rest] = path.getAttribute("d").match(/^M(\d+) (\d+)l?(.*)$/);
    const steps = (rest.match(/-?\d+/g) || []).map(Number);
    let [x, y] = [Number(x0), Number(y0)];
    const found = [[x / 2, y / 2]];
    for (let k = 0; k + 1 < steps.length; k += 2) { x += steps[k]; y += steps[k + 1]; found.push([x / 2, y / 2]); }
    return found;
  };
  const read = (svg, x) => {
    const [left, right, low, high] = svg.dataset.x.split(" ").map(Number);
    const at = Math.min(Math.max(x, left), right);
    const cursor = one(".cursor", svg);
    cursor.style.visibility = "visible";
    cursor.setAttribute("transform", `translate(${at},0)`);
    const words = [`${(low + (at - left) / (right - left) * (high - low)).toFixed(2)} s`];
    for (const panel of all(".panel", svg)) {
      const [bottom, top, most, least] = [0, 1, 2, 3].map((k) => Number(panel.dataset.y.split(" ")[k]));
      const values = all("path:not(.off):not(.marks)", panel).map((path) => {
        path.points = path.points || points(path);
        const near = path.points.reduce((a, b) => (Math.abs(b[0] - at) < Math.abs(a[0] - at) ? b : a));
        const value = least + (bottom - near[1]) / (bottom - top) * (most - least);
        return `${path.dataset.series} ${value.toPrecision(3)}`;
      });
      if (values.length) words.push(`${panel.dataset.label} [N m]: ${values.join(", ")}`);
    }
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
