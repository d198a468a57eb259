"use strict";
for (const table of document.querySelectorAll("table.sortable")) {
  table.querySelectorAll("th").forEach((head, column) => head.addEventListener("click", () => {
    const down = head.getAttribute("aria-sort") === "ascending";
    table.querySelectorAll("th").forEach(other => other.removeAttribute("aria-sort"));
    head.setAttribute("aria-sort", down ? "descending" : "ascending");
    const body = table.tBodies[0];
    const rows = [...body.rows].map(row => [row, row.cells[column].dataset.v ?? row.cells[column].textContent.trim()]);
    rows.sort(([, a], [, b]) => {
      if (a === "" || b === "") return (a === "") - (b === "");
      const order = isNaN(a) || isNaN(b) ? a.localeCompare(b, undefined, {numeric: true}) : a - b;
      return down ? -order : order;
    });
    body.append(...rows.map(([row]) => row));
  }));
}
const search = document.getElementById("search");
const hidden = new Set();
function filter() {
  const words = search.value.toLowerCase().split(/\s+/).filter(Boolean);
  for (const item of document.querySelectorAll("[data-find]"))
    item.hidden = !words.every(word => item.dataset.find.toLowerCase().includes(word)) || hidden.has(item.dataset.c);
}
search?.addEventListener("input", filter);
for (const box of document.querySelectorAll("input[data-controller]"))
  box.addEventListener("change", () => {
    hidden[box.checked ? "delete" : "add"](box.dataset.controller);
    for (const track of document.querySelectorAll(`.track[data-c="${box.dataset.controller}"]`)) track.toggleAttribute("hidden", !box.checked);
    filter();
  });
for (const svg of document.querySelectorAll(".map svg"))
  svg.addEventListener("click", () => svg.closest(".map").classList.toggle("large"));
for (const cell of document.querySelectorAll("td[data-s]"))
  cell.addEventListener("click", () => {
    const row = cell.closest("tr"), map = document.getElementById("map-" + row.dataset.w);
    if (!map) return;
    document.querySelectorAll(".marked, .lit").forEach(item => item.classList.remove("marked", "lit"));
    document.querySelectorAll("svg.dim").forEach(item => item.classList.remove("dim"));
    map.classList.add("marked", "large");
    const tracks = map.querySelectorAll(`.track[data-c="${row.dataset.c}"][data-s="${cell.dataset.s}"]`);
    tracks.forEach(track => track.classList.add("lit"));
    map.querySelector("svg").classList.toggle("dim", tracks.length > 0);
    map.scrollIntoView({behavior: "smooth"});
  });
