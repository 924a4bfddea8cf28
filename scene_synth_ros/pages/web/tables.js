// Tables.

/** Fills a table; cells are texts or functions that fill a cell; columns in `numbers` stand right. */
function fillTable(table, head, rows, numbers, empty) {
  table.replaceChildren();
  if (!rows.length) {
    element('td', empty, element('tr', null, element('tbody', null, table)), 'empty');
    return [];
  }
  const line = element('tr', null, element('thead', null, table));
  head.forEach((text, column) => {
    const cell = element('th', text, line, numbers.includes(column) ? 'number' : '');
    cell.scope = 'col';
  });
  const body = element('tbody', null, table);
  return rows.map((cells) => {
    const row = element('tr', null, body);
    cells.forEach((content, column) => {
      const cell = element('td', typeof content === 'function' ? null : content, row, numbers.includes(column) ? 'number' : '');
      if (typeof content === 'function') content(cell);
    });
    return row;
  });
}

/** Makes the heads of a table buttons that sort its rows by their cells, numbers by value. */
function sortable(table) {
  table.querySelectorAll('th').forEach((head, column) => {
    const button = element('button', head.textContent, null, 'sort');
    button.type = 'button';
    head.replaceChildren(button);
    button.addEventListener('click', () => {
      const order = head.getAttribute('aria-sort') === 'descending' ? 1 : -1;
      table.querySelectorAll('th').forEach((other) => other.removeAttribute('aria-sort'));
      head.setAttribute('aria-sort', order < 0 ? 'descending' : 'ascending');
      const body = table.tBodies[0];
      const key = (row) => row.cells[column].textContent;
      const value = (row) => Number(key(row).replaceAll(',', '').replace('−', '-').split(' ')[0]);
      const compare = (a, b) => (Number.isNaN(value(a) + value(b)) ? key(a).localeCompare(key(b)) : value(a) - value(b));
      body.append(...[...body.rows].sort((a, b) => order * compare(a, b)));
    });
  });
}

