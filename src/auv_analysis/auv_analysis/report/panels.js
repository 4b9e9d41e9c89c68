'use strict';
// the panels: Bokeh's document into its places, and controls that act on all of it

async function inflated(id) {
  const bytes = Uint8Array.from(atob(document.getElementById(id).textContent.trim()), (letter) => letter.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream('deflate'));
  return JSON.parse(await new Response(stream).text());
}

function connect(bar, figures) {
  const time = figures[0].x_range;
  const [start, end] = [time.start, time.end];
  const early = start + Number(bar.dataset.transient);
  const windows = { whole: [start, end], early: [start, early], late: [early, end] };
  for (const button of bar.querySelectorAll('[data-window]')) {
    const [from, to] = windows[button.dataset.window];
    button.addEventListener('click', () => time.setv({ start: from, end: to }));
  }
  const chosen = (name) => new Set([...bar.querySelectorAll(`[name=${name}]:checked`)].map((box) => box.value));
  bar.addEventListener('change', () => {
    const [runs, dofs] = [chosen('runs'), chosen('dofs')];
    for (const line of figures.flatMap((figure) => figure.renderers)) {
      const [run, dof] = line.tags;
      line.visible = runs.has(run) && (!dof || dofs.has(dof));
    }
  });
}

async function startPanels() {
  const bar = document.querySelector('.panel-controls');
  if (!bar || typeof DecompressionStream === 'undefined') return;
  const [content, roots] = await inflated('panel-data');
  Bokeh.set_log_level('error');
  document.documentElement.classList.add('with-panels');
  const stills = [...document.querySelectorAll('details.stills')];
  const wanted = document.getElementById(location.hash.slice(1));
  for (const details of stills) details.open = details.contains(wanted);
  const places = Object.fromEntries(Object.entries(roots).map(([name, id]) => [id, document.querySelector(`[data-panel="${CSS.escape(name)}"] .plot`)]));
  await Bokeh.embed.embed_items({ panels: content }, [{ docid: 'panels', roots: places, root_ids: Object.values(roots) }]);
  connect(bar, Object.values(roots).map((id) => Bokeh.documents.at(-1).get_model_by_id(id)));
  bar.open = !matchMedia('(max-width: 40rem)').matches;
  bar.dataset.ready = 'yes';
  wanted?.scrollIntoView();
  window.addEventListener('beforeprint', () => stills.forEach((details) => { details.open = true; }));
}
startPanels();
