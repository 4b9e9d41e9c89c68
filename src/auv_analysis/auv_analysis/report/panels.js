'use strict';
// what all panels share: the time axis, the time pointed at, what is shown, the theme

class PanelState {
  constructor(index, bar) {
    this.bar = bar;
    this.whole = [index.start, index.end];
    this.window = this.whole;
    this.pointed = null;
    this.logarithmic = false;
    this.drag = 'zoom';
    this.dashes = index.runs;
    this.runs = new Set(Object.keys(index.runs));
    this.dofs = new Set();
    this.views = [];
    this.asked = 0;
    this.version = 0;
  }

  // everything that is asked for until the next frame is done at once
  refresh() {
    this.version += 1;
    this.bar.dataset.version = this.version;
    cancelAnimationFrame(this.asked);
    this.asked = requestAnimationFrame(() => {
      for (const view of this.views) view.refresh();
      document.dispatchEvent(new CustomEvent('panels'));
    });
  }

  moveTo(start, end) {
    const [begin, stop] = this.whole;
    const width = Math.min(Math.max(end - start, 1e-6 * (stop - begin)), stop - begin);
    const from = Math.min(Math.max(start, begin), stop - width);
    if (this.window[0] === from && this.window[1] === from + width) return;
    this.window = [from, from + width];
    this.refresh();
  }

  pan(share) {
    const [start, end] = this.window;
    this.moveTo(start + share * (end - start), end + share * (end - start));
  }

  zoom(factor) {
    const [start, end] = this.window;
    const middle = this.pointed !== null && this.pointed >= start && this.pointed <= end ? this.pointed : (start + end) / 2;
    const [left, right] = [(middle - start) * factor, (end - middle) * factor];
    this.moveTo(middle - left, middle + right);
  }

  pointAt(time) {
    const [start, end] = this.window;
    this.pointed = time === null ? null : Math.min(Math.max(time, start), end);
    for (const view of this.views) view.read();
    document.dispatchEvent(new CustomEvent('panels'));
  }

  step(share) {
    const [start, end] = this.window;
    this.pointAt((this.pointed ?? start) + share * (end - start));
  }
}

const KEYS = {
  ArrowLeft: (state) => state.pan(-0.2),
  ArrowRight: (state) => state.pan(0.2),
  '+': (state) => state.zoom(0.5),
  '=': (state) => state.zoom(0.5),
  '-': (state) => state.zoom(2),
  Home: (state) => state.moveTo(...state.whole),
  Escape: (state) => state.pointAt(null),
};
const SHIFTED = { ArrowLeft: (state) => state.step(-0.01), ArrowRight: (state) => state.step(0.01) };

function onKey(event, state) {
  if (event.ctrlKey || event.altKey || event.metaKey || event.target.matches('input[type=number], summary')) return;
  const action = (event.shiftKey && SHIFTED[event.key]) || KEYS[event.key];
  if (!action) return;
  event.preventDefault();
  action(state);
}

function connectControls(bar, state) {
  const [from, to] = ['from', 'to'].map((name) => bar.querySelector(`[name=${name}]`));
  const limit = Number(bar.dataset.transient);
  const [begin, stop] = state.whole;
  const actions = {
    whole: () => state.moveTo(begin, stop),
    early: () => state.moveTo(begin, begin + limit),
    late: () => state.moveTo(begin + limit, stop),
    left: KEYS.ArrowLeft, right: KEYS.ArrowRight, closer: KEYS['+'], further: KEYS['-'],
  };
  for (const button of bar.querySelectorAll('[data-action]')) {
    button.addEventListener('click', () => actions[button.dataset.action](state));
  }
  for (const box of [from, to]) {
    box.addEventListener('change', () => {
      const [start, end] = [from.valueAsNumber, to.valueAsNumber];
      const valid = start < end;
      to.setCustomValidity(valid ? '' : 'The end comes after the start.');
      if (valid) state.moveTo(start, end);
      else to.reportValidity();
    });
  }
  for (const name of ['dofs', 'runs']) {
    for (const box of bar.querySelectorAll(`[name=${name}]`)) {
      if (box.checked) state[name].add(box.value);
      box.addEventListener('change', () => {
        state[name][box.checked ? 'add' : 'delete'](box.value);
        state.refresh();
      });
    }
  }
  bar.querySelector('[name=logarithmic]').addEventListener('change', ({ target }) => {
    state.logarithmic = target.checked;
    state.refresh();
  });
  bar.querySelector('[name=drag]').addEventListener('change', ({ target }) => {
    state.drag = target.value;
    state.refresh();
  });
  const shown = bar.querySelector('output');
  document.addEventListener('panels', () => {
    [from.value, to.value] = state.window.map((time) => Number(time.toPrecision(6)));
    shown.textContent = state.pointed === null ? 'point at a panel for values' : `t = ${digits(state.pointed)} s`;
  });
}

async function startPanels() {
  const bar = document.querySelector('.panel-controls');
  if (!bar || typeof DecompressionStream === 'undefined') return;
  const index = await unpacked();
  Bokeh.set_log_level('error');
  const state = new PanelState(index, bar);
  connectControls(bar, state);
  const seen = new IntersectionObserver((entries) => {
    for (const { isIntersecting, target } of entries) {
      const view = state.views.find(({ host }) => host === target);
      view.near = isIntersecting;
      view.refresh();
    }
  }, { rootMargin: '300px' });
  for (const host of document.querySelectorAll('[data-panel]')) {
    const view = new PanelView(host, index.panels[host.dataset.panel], state);
    state.views.push(view);
    for (const event of ['focusin', 'focusout']) host.addEventListener(event, () => view.refresh());
    host.addEventListener('keydown', (event) => onKey(event, state));
    seen.observe(host);
  }
  bar.addEventListener('keydown', (event) => onKey(event, state));
  document.addEventListener('theme', () => state.views.forEach((view) => view.paint()));
  showPanels(bar);
  state.refresh();
}

// in the place of the still figures, which stay for paper
function showPanels(bar) {
  const stills = [...document.querySelectorAll('details.stills')];
  const wanted = document.getElementById(location.hash.slice(1));
  document.documentElement.classList.add('with-panels');
  for (const details of stills) details.open = details.contains(wanted);
  const narrow = matchMedia('(max-width: 40rem)');
  const fold = () => { bar.open = !narrow.matches; };
  narrow.addEventListener('change', fold);
  fold();
  wanted?.scrollIntoView();
  window.addEventListener('beforeprint', () => stills.forEach((details) => { details.open = true; }));
}
startPanels();
