"use strict";
(() => {
  const table = JSON.parse(document.getElementById("case-data").textContent);
  const size = 100;
  const body = document.querySelector("#cases tbody");
  const heads = [...document.querySelectorAll("#cases thead th")];
  const [back, forth] = document.querySelectorAll(".pager button");
  const status = document.getElementById("case-status");
  let order = Array.from({ length: table.count }, (_, row) => row);
  let page = 0, sorted = -1, descending = false;

  const value = (column, row) => (column.values ? column.values[row] : column.first + row);
  const text = (column, row) => {
    const cell = value(column, row);
    if (column.words) return column.words[cell];
    return cell === null ? "\u2013" : String(cell).replace("-", "\u2212");
  };

  function draw() {
    const first = page * size;
    const rows = order.slice(first, first + size).map((row) => {
      const line = document.createElement("tr");
      for (const column of table.columns) {
        const cell = line.appendChild(document.createElement("td"));
        cell.textContent = text(column, row);
        if (column.words) cell.className = "word";
      }
      return line;
    });
    body.replaceChildren(...rows);
    back.disabled = page === 0;
    forth.disabled = first + size >= table.count;
    const by = sorted < 0 ? "" : `, by ${table.columns[sorted].name}, ${descending ? "largest" : "smallest"} first`;
    const last = Math.min(first + size, table.count);
    status.textContent = `Rows ${(table.count && first + 1).toLocaleString("en")} to ${last.toLocaleString("en")} of ` +
      `${table.count.toLocaleString("en")}${by}`;
  }

  function sort(index) {
    const column = table.columns[index];
    descending = sorted === index ? !descending : false;
    sorted = index;
    const sign = descending ? -1 : 1;
    order.sort((a, b) => {
      const x = value(column, a), y = value(column, b);
      if (x === y) return a - b;
      if (x === null) return 1;
      if (y === null) return -1;
      return x < y ? -sign : sign;
    });
    heads.forEach((head, k) => {
      if (k === index) head.setAttribute("aria-sort", descending ? "descending" : "ascending");
      else head.removeAttribute("aria-sort");
    });
    page = 0;
    draw();
  }

  heads.forEach((head, k) => head.firstElementChild.addEventListener("click", () => sort(k)));
  back.addEventListener("click", () => { page -= 1; draw(); });
  forth.addEventListener("click", () => { page += 1; draw(); });
  draw();
})();
