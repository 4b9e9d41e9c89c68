'use strict';
// the packed lines of the panels, as packing.py writes them

async function inflated(id) {
  const text = document.getElementById(id).textContent.trim();
  const bytes = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream('deflate'));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

// times of an axis, s: from each sample to the next so many ticks
function times(bytes, { at, count, start, tick }) {
  const t = new Float64Array(count);
  let ticks = 0;
  for (let i = 0; i < count; i++) {
    const place = at + i;
    ticks += bytes[place] + 256 * bytes[place + count] + 65536 * bytes[place + 2 * count] + 16777216 * bytes[place + 3 * count];
    t[i] = start + ticks * tick;
  }
  return t;
}

// values of a line: float32 whose last byte is zero
function values(bytes, at, count) {
  const words = new Uint32Array(count);
  for (let i = 0; i < count; i++) {
    const place = at + i;
    words[i] = (bytes[place] << 8) | (bytes[place + count] << 16) | (bytes[place + 2 * count] << 24);
  }
  return Float64Array.from(new Float32Array(words.buffer));
}

// all panels by name, each with its models and its lines {run, key, t, y}
async function unpacked() {
  const [bytes, text] = await Promise.all([inflated('panel-data'), inflated('panel-index')]);
  const index = JSON.parse(new TextDecoder().decode(text));
  const axes = index.axes.map((axis) => times(bytes, axis));
  for (const panel of Object.values(index.panels)) {
    panel.models = panel.kinds.map((kind) => index.models[`${kind} ${panel.lines.length}`]);
    panel.lines = panel.lines.map(({ run, key, axis, at }) => ({
      run, key, t: axes[axis], y: values(bytes, at, axes[axis].length),
    }));
  }
  return index;
}

// number of the first sample that is not before a time; their count, if all are
function first(t, time) {
  let low = 0;
  let high = t.length;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (t[middle] < time) low = middle + 1;
    else high = middle;
  }
  return low;
}

// number of the sample nearest to a time; -1: the line ends before it or begins after it
function nearest(t, time) {
  const i = first(t, time);
  const reach = t.length > 1 ? (t.at(-1) - t[0]) / (t.length - 1) : 0;
  if (time < t[0] - reach || time > t.at(-1) + reach) return -1;
  if (i === 0) return 0;
  return i === t.length || time - t[i - 1] < t[i] - time ? i - 1 : i;
}
