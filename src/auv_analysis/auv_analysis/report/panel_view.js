'use strict';
// one panel: Bokeh's figure, and beside it a table that is its key and shows the values at a time

const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();
const digits = (x) => (x === 0 ? '0' : Number(x.toPrecision(4)).toString().replace('-', '\u2212'));

class PanelView {
  constructor(host, content, state) {
    Object.assign(this, { host, content, state, hidden: new Set(), figure: null, form: -1 });
    this.cells = [...host.querySelectorAll('[data-line]')];
    for (const box of host.querySelectorAll('input[data-key]')) {
      box.addEventListener('change', () => {
        this.hidden[box.checked ? 'delete' : 'add'](Number(box.dataset.key));
        this.update();
      });
    }
  }

  // Bokeh's models are built when the panel is first seen, and again for another vertical axis
  async render() {
    const form = this.state.logarithmic && this.content.kind === 'both' ? 1 : 0;
    if (form === this.form) return;
    this.form = form;
    const target = this.host.querySelector('.plot');
    const old = this.figure;
    const views = await Bokeh.embed.embed_item(structuredClone(this.content.items[form]), target);
    if (old) {
      old.document.clear();
      while (target.children.length > 1) target.firstElementChild.remove();
    }
    const root = views.roots[0];
    this.figure = root.model;
    const models = [...this.figure.references()];
    this.named = (name) => models.find((model) => model.name === name);
    this.models = models;
    this.lines = this.content.lines.map((_, i) => this.named(`line ${i}`));
    this.time = this.named('time');
    this.wheel = models.find((model) => model.type === 'WheelZoomTool');
    this.drags = { pan: models.find((model) => model.type === 'PanTool'), zoom: models.find((model) => model.type === 'BoxZoomTool') };
    this.fill();
    const moved = () => this.state.moveTo(this.time.start, this.time.end);
    this.time.on_change([this.time.properties.start, this.time.properties.end], moved);
    this.figure.on_event('mousemove', ({ x }) => this.state.pointAt(x));
    this.figure.on_event('tap', ({ x }) => this.state.pointAt(x));
    this.figure.on_event('doubletap', () => this.state.moveTo(...this.state.whole));
    this.update();
  }

  fill() {
    this.content.lines.forEach((line, i) => {
      const shown = this.form === 1 || this.content.kind === 'log';
      const y = shown ? line.y.map((value) => Math.abs(value) || NaN) : line.y;
      this.lines[i].data_source.data = { t: line.t, y, base: new Float64Array(y.length) };
    });
  }

  shows({ run, key }) {
    const { label, dof } = this.content.keys[key];
    return this.state.runs.has(run) && !this.hidden.has(key) && (!dof || this.state.dofs.has(label));
  }

  update() {
    if (!this.figure) return;
    const [start, end] = this.state.window;
    this.content.lines.forEach((line, i) => { this.lines[i].visible = this.shows(line); });
    if (this.time.start !== start || this.time.end !== end) this.time.setv({ start, end });
    if (this.content.kind === 'stack') this.stack();
    this.named('values').setv(this.range(start, end));
    this.wheel.active = this.host.contains(document.activeElement);
    this.figure.toolbar.active_drag = this.drags[this.state.drag];
    this.read();
    this.host.dataset.ready = '';
  }

  // areas of what is shown, each on those before it
  stack() {
    let base = new Float64Array(this.content.lines[0].t.length);
    this.content.lines.forEach((line, i) => {
      if (!this.lines[i].visible) return;
      const top = base.map((value, k) => value + line.y[k]);
      this.lines[i].data_source.data = { t: line.t, y: top, base };
      base = top;
    });
  }

  // the vertical axis fits what is shown between these times
  range(start, end) {
    if (this.content.kind === 'stack') return { start: 0, end: 100 };
    const logarithmic = this.form === 1 || this.content.kind === 'log';
    let [low, high] = [Infinity, -Infinity];
    this.content.lines.forEach((line, i) => {
      if (!this.lines[i].visible) return;
      const { t, y } = this.lines[i].data_source.data;
      const stop = Math.min(first(t, end) + 1, t.length);
      for (let k = Math.max(first(t, start) - 1, 0); k < stop; k++) {
        if (y[k] < low) low = y[k];
        if (y[k] > high) high = y[k];
      }
    });
    if (low > high) return logarithmic ? { start: 0.1, end: 1 } : { start: -1, end: 1 };
    if (logarithmic) return { start: low / 1.5, end: high * 1.5 };
    const margin = 0.05 * (high - low) || 0.05 * Math.abs(high) || 1;
    return { start: low - margin, end: high + margin };
  }

  // values at the time pointed at, of the samples that are nearest to it
  read() {
    const { pointed } = this.state;
    const cursor = this.figure && this.named('cursor');
    if (cursor) cursor.setv({ location: pointed, visible: pointed !== null });
    for (const cell of this.cells) {
      const line = this.content.lines[cell.dataset.line];
      const i = pointed === null ? -1 : nearest(line.t, pointed);
      const shown = this.shows(line);
      cell.textContent = i < 0 || !shown ? '' : digits(line.y[i]);
      cell.classList.toggle('off', !shown);
    }
  }

  paint() {
    if (!this.figure) return;
    const [ink, soft, hair] = ['ink', 'soft', 'hair'].map(colour);
    for (const model of this.models) {
      if (model.type.endsWith('Axis')) {
        model.setv({ axis_label_text_color: ink, major_label_text_color: soft, axis_line_color: soft, major_tick_line_color: soft });
      } else if (model.type === 'Grid') model.grid_line_color = hair;
      else if (model.type === 'Span') model.line_color = soft;
    }
    this.content.lines.forEach(({ key }, i) => {
      if (this.content.keys[key].colour === 'ink') this.lines[i].glyph.line_color = ink;
    });
  }
}
