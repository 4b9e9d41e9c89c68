'use strict';
// light, dark or as the system has it; the choice is kept where the browser lets a file keep it

(() => {
  const root = document.documentElement;
  const button = document.querySelector('.theme');
  const names = ['auto', 'light', 'dark'];
  const dark = matchMedia('(prefers-color-scheme: dark)');
  let chosen = 'auto';
  try { chosen = localStorage.getItem('theme') ?? 'auto'; } catch { /* a browser that keeps nothing */ }

  function apply() {
    const theme = chosen === 'auto' ? (dark.matches ? 'dark' : 'light') : chosen;
    root.dataset.theme = theme;
    button.textContent = `Theme: ${chosen}`;
    document.dispatchEvent(new CustomEvent('theme'));
  }

  button.hidden = false;
  button.addEventListener('click', () => {
    chosen = names[(names.indexOf(chosen) + 1) % names.length];
    try { localStorage.setItem('theme', chosen); } catch { /* it holds until the page is closed */ }
    apply();
  });
  dark.addEventListener('change', apply);
  apply();
})();
