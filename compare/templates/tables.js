/* Tables: a click on a header sorts, words in the box above filter. */
(() => {
  const key = (row, column) => {
    const cell = row.cells[column], data = cell && cell.querySelector("data");
    return data ? Number(data.value) : cell ? cell.textContent.trim() : "";
  };
  const compare = (a, b) => {
    const empty = (value) => value === "\u2013" || value === "";
    if (empty(a) || empty(b)) return empty(a) - empty(b) || 0;
    if (typeof a === "number" && typeof b === "number") return a - b;
    return String(a).localeCompare(String(b), "en", { numeric: true });
  };

  function sort(table, header, column) {
    const down = header.getAttribute("aria-sort") === "ascending";
    for (const other of table.querySelectorAll("th[aria-sort]")) other.removeAttribute("aria-sort");
    header.setAttribute("aria-sort", down ? "descending" : "ascending");
    const rows = [...table.tBodies[0].rows].map((row) => [key(row, column), row]);
    const last = (value) => value === "\u2013" || value === "";
    rows.sort(([a], [b]) => (down && !last(a) && !last(b) ? -compare(a, b) : compare(a, b)));
    table.tBodies[0].append(...rows.map(([, row]) => row));
  }

  function filter(table, words, count) {
    const wanted = words.toLowerCase().split(/\s+/).filter(Boolean);
    let left = 0;
    for (const row of table.tBodies[0].rows) {
      const text = row.textContent.toLowerCase();
      row.hidden = !wanted.every((word) => text.includes(word));
      left += !row.hidden;
    }
    count.textContent = wanted.length ? `${left} of ${table.tBodies[0].rows.length} rows` : "";
  }

  for (const box of document.querySelectorAll(".box")) {
    const table = box.querySelector("table"), rows = table.tBodies[0].rows;
    if (rows.length < 2) continue;
    [...table.tHead.rows[table.tHead.rows.length - 1].cells].forEach((header, column) => {
      const button = make("button", { type: "button", class: "sort", click: () => sort(table, header, column) });
      button.append(...header.childNodes);
      header.append(button);
    });
    if (rows.length < 6) continue;
    const count = make("span", { class: "soft", "aria-live": "polite" });
    const input = make("input", {
      type: "search", placeholder: "filter rows", "aria-label": `filter rows: ${box.getAttribute("aria-label")}`,
      input: () => filter(table, input.value, count),
    });
    box.before(make("div", { class: "filter" }, input, count));
  }
})();
