"use strict";
// A table is sorted by the heading that is pressed: numbers by what they are, names by the alphabet, empty cells last.
for (const table of document.querySelectorAll("table.sortable")) {
  const heads = Array.from(table.tHead.rows[0].cells), body = table.tBodies[0];
  heads.forEach((head, column) => {
    const button = document.createElement("button");
    button.type = "button";
    button.textContent = head.textContent;
    head.replaceChildren(button);
    button.addEventListener("click", () => {
      const down = head.getAttribute("aria-sort") === "ascending" ? -1 : 1;
      for (const other of heads) other.removeAttribute("aria-sort");
      head.setAttribute("aria-sort", down > 0 ? "ascending" : "descending");
      const of = row => {
        const text = row.cells[column].dataset.value ?? row.cells[column].textContent.trim();
        return text === "" ? null : isNaN(Number(text)) ? text : Number(text);
      };
      const rows = Array.from(body.rows).map(row => [of(row), row]);
      rows.sort(([a], [b]) => a === null || b === null ? (a === null) - (b === null)
        : down * (typeof a === "number" && typeof b === "number" ? a - b : String(a).localeCompare(String(b))));
      body.append(...rows.map(pair => pair[1]));
    });
  });
}
