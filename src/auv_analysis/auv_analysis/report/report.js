'use strict';
// tables that sort and download; links that open what they lead to

const text = (cell) => cell.textContent.replace(/\s+/g, ' ').trim();

// what a cell is sorted by: its number where it has one; what is missing goes last
function key(cell) {
  const number = Number(cell.dataset.value);
  return cell.dataset.value !== undefined && !Number.isNaN(number) ? number : text(cell);
}

function compare(a, b) {
  if (a === b) return 0;
  if (a === '–' || a === '') return 1;
  if (b === '–' || b === '') return -1;
  if (typeof a === 'number' && typeof b === 'number') return a - b;
  if (typeof a !== typeof b) return typeof a === 'number' ? -1 : 1;
  return a.localeCompare(b, undefined, { numeric: true });
}

function sort(table, column) {
  const heads = [...table.tHead.rows].at(-1).cells;
  const head = heads[column];
  const down = head.getAttribute('aria-sort') === 'ascending';
  for (const other of heads) other.removeAttribute('aria-sort');
  head.setAttribute('aria-sort', down ? 'descending' : 'ascending');
  const body = table.tBodies[0];
  const rows = [...body.rows].map((row) => [key(row.cells[column]), row]);
  const missing = (value) => value === '–' || value === '';
  rows.sort(([a], [b]) => (down && !missing(a) && !missing(b) ? compare(b, a) : compare(a, b)));
  body.append(...rows.map(([, row]) => row));
}

// full precision where a cell has a number, else what is shown
function csv(table) {
  const quoted = (value) => (/[",\n]/.test(value) ? `"${value.replaceAll('"', '""')}"` : value);
  const groups = [];
  if (table.tHead.rows.length > 1) {
    for (const cell of table.tHead.rows[0].cells) groups.push(...Array(cell.colSpan).fill(text(cell)));
  }
  const heads = [...[...table.tHead.rows].at(-1).cells].map((cell, i) => `${groups[i] ?? ''} ${text(cell)}`.trim());
  const rows = [...table.tBodies[0].rows].map((row) => [...row.cells].map((cell) => cell.dataset.value ?? text(cell)));
  return [heads, ...rows].map((row) => row.map(quoted).join(',')).join('\r\n') + '\r\n';
}

function download(name, content) {
  const link = document.createElement('a');
  link.href = URL.createObjectURL(new Blob([content], { type: 'text/csv' }));
  link.download = name;
  link.click();
  URL.revokeObjectURL(link.href);
}

for (const table of document.querySelectorAll('table.data')) {
  for (const button of table.querySelectorAll('.sort')) {
    button.addEventListener('click', () => sort(table, button.parentElement.cellIndex));
  }
  const button = table.querySelector('.csv');
  button.hidden = false;
  button.addEventListener('click', () => download(`${table.dataset.name}.csv`, csv(table)));
}

function reveal() {
  const target = location.hash && document.getElementById(location.hash.slice(1));
  if (!target) return;
  for (let at = target; at; at = at.parentElement) if (at.tagName === 'DETAILS') at.open = true;
  target.scrollIntoView();
}
window.addEventListener('hashchange', reveal);
reveal();
