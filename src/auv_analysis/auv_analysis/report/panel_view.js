'use strict';
// one panel: Bokeh's figure, and above it a table that is its key and shows the values at a time

const SUPERSCRIPTS = { '-': '⁻', 0: '⁰', 1: '¹', 2: '²', 3: '³', 4: '⁴', 5: '⁵', 6: '⁶', 7: '⁷', 8: '⁸', 9: '⁹' };
const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();

// four digits of a number, as the tables of the report write it
function digits(x) {
  if (x === 0) return '0';
  const power = Number(x.toExponential(3).split('e')[1]);
  const mantissa = x.toExponential(3).split('e')[0];
  const raised = [...String(power)].map((letter) => SUPERSCRIPTS[letter]).join('');
  const text = power < -3 || power > 6 ? `${mantissa}·10${raised}` : x.toFixed(Math.max(3 - power, 0));
  return text.replace('-', '−');
}

class PanelView {
  constructor(host, content, state) {
    Object.assign(this, { host, content, state, hidden: new Set(), figure: null, kind: '' });
    this.near = false;
    this.work = Promise.resolve();
    this.cells = [...host.querySelectorAll('[data-line]')];
    for (const box of host.querySelectorAll('input[data-key]')) {
      box.addEventListener('change', () => {
        this.hidden[box.checked ? 'delete' : 'add'](Number(box.dataset.key));
        this.update();
      });
    }
  }

  get logarithmic() {
    return this.kind === 'log';
  }

  // what is out of sight is drawn when it comes into sight
  refresh() {
    if (!this.near) return this.work;
    this.work = this.work.then(() => this.build()).then(() => this.update());
    return this.work;
  }

  // Bokeh's models are made when the panel is first seen, and again for another vertical axis
  async build() {
    const form = this.content.kinds.length > 1 && this.state.logarithmic ? 1 : 0;
    const kind = this.content.kinds[form];
    if (kind === this.kind) return;
    const target = this.host.querySelector('.plot');
    const [old, shown] = [this.figure, [...target.children]];
    const views = await Bokeh.embed.embed_item(structuredClone(this.content.models[form]), target);
    if (old) old.document.clear();
    for (const element of shown) element.remove();
    this.kind = kind;
    this.figure = views.roots[0].model;
    this.models = [...this.figure.references()];
    const named = (name) => this.models.find((model) => model.name === name);
    const typed = (type) => this.models.find((model) => model.type === type);
    this.lines = this.content.lines.map((_, i) => named(`line ${i}`));
    this.wheel = typed('WheelZoomTool');
    this.drags = { pan: typed('PanTool'), zoom: typed('BoxZoomTool') };
    this.cursor = named('cursor');
    this.dress();
    this.listen(this.figure.x_range);
    this.paint();
  }

  dress() {
    const { keys, label, unit, kinds } = this.content;
    this.figure.name = this.host.dataset.panel;
    this.figure.left[0].axis_label = `${this.logarithmic && kinds.length > 1 ? `|${label}|` : label} (${unit})`;
    this.content.lines.forEach((line, i) => {
      const y = this.logarithmic ? line.y.map((value) => Math.abs(value) || NaN) : line.y;
      const { data_source: source, glyph } = this.lines[i];
      source.data = { t: line.t, y, base: new Float64Array(y.length) };
      if (this.kind !== 'stack') glyph.setv({ line_dash: this.state.dashes[line.run], line_width: keys[line.key].width });
    });
  }

  listen(time) {
    const { state, figure } = this;
    time.on_change([time.properties.start, time.properties.end], () => state.moveTo(time.start, time.end));
    for (const event of ['mousemove', 'tap']) figure.on_event(event, ({ x }) => state.pointAt(x));
    figure.on_event('doubletap', () => state.moveTo(...state.whole));
  }

  shows({ run, key }) {
    const { label, dof } = this.content.keys[key];
    return this.state.runs.has(run) && !this.hidden.has(key) && (!dof || this.state.dofs.has(label));
  }

  update() {
    const [start, end] = this.state.window;
    const { figure } = this;
    this.content.lines.forEach((line, i) => { this.lines[i].visible = this.shows(line); });
    if (figure.x_range.start !== start || figure.x_range.end !== end) figure.x_range.setv({ start, end });
    if (this.kind === 'stack') this.stack();
    figure.y_range.setv(this.fitted(start, end));
    this.wheel.active = this.host.contains(document.activeElement);
    figure.toolbar.active_drag = this.drags[this.state.drag];
    this.read();
    this.host.dataset.version = this.state.version;
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

  // ends of the vertical axis, about what is shown between two times
  fitted(start, end) {
    if (this.kind === 'stack') return { start: 0, end: 100 };
    let [low, high] = [Infinity, -Infinity];
    for (const { visible, data_source: { data: { t, y } } } of this.lines) {
      if (!visible) continue;
      const stop = Math.min(first(t, end) + 1, t.length);
      for (let k = Math.max(first(t, start) - 1, 0); k < stop; k++) {
        if (y[k] < low) low = y[k];
        if (y[k] > high) high = y[k];
      }
    }
    if (low > high) return this.logarithmic ? { start: 0.1, end: 1 } : { start: -1, end: 1 };
    if (this.logarithmic) return { start: low / 1.5, end: high * 1.5 };
    const margin = 0.05 * (high - low) || 0.05 * Math.abs(high) || 1;
    return { start: low - margin, end: high + margin };
  }

  // values of the samples that are nearest to the time pointed at
  read() {
    if (!this.near || !this.figure) return;
    const { pointed } = this.state;
    this.cursor.setv({ location: pointed, visible: pointed !== null });
    for (const cell of this.cells) {
      const line = this.content.lines[cell.dataset.line];
      const i = pointed === null || !this.shows(line) ? -1 : nearest(line.t, pointed);
      cell.textContent = i < 0 || Number.isNaN(line.y[i]) ? '' : digits(line.y[i]);
    }
  }

  // the colours of the page
  paint() {
    if (!this.figure) return;
    const [ink, soft, hair] = ['ink', 'soft', 'hair'].map(colour);
    const axis = { axis_label_text_color: ink, major_label_text_color: soft, axis_line_color: soft, major_tick_line_color: soft };
    for (const model of this.models) {
      if (model.type.endsWith('Axis')) model.setv(axis);
      else if (model.type === 'Grid') model.grid_line_color = hair;
      else if (model.type === 'Span') model.line_color = soft;
      else if (model.type === 'Label') model.text_color = soft;
    }
    this.content.lines.forEach(({ key }, i) => {
      const shade = this.content.keys[key].colour;
      this.lines[i].glyph[this.kind === 'stack' ? 'fill_color' : 'line_color'] = shade === 'ink' ? ink : shade;
    });
  }
}
