// What the user chooses: task, metric, evaluations; and the start of the page.

const state = { task: 0, metric: '', hidden: new Set() };
const visible = () => data.evaluations.map((_, k) => k).filter((k) => !state.hidden.has(k));

function show(change) {
  const before = state.task;
  Object.assign(state, change);
  const task = data.tasks[state.task], shown = visible();
  if (!task) return;
  if (!task.metrics.some((metric) => metric.name === state.metric)) state.metric = task.metrics.length ? task.metrics[0].name : '';
  if (state.task !== before || !by('metric').options.length) fillMetrics(task);
  const metric = task.metrics.find((one) => one.name === state.metric);
  by('task').value = state.task;
  by('metric').value = state.metric;
  document.querySelectorAll('.chosen-metric').forEach((node) => (node.textContent = `${spaced(task.name)}, ${spaced(state.metric)}`));
  by('estimate').textContent = task.estimate && `What was estimated: ${task.estimate}.`;
  fillScores(task, shown, (name) => show({ metric: name }));
  if (metric) {
    fillRanking(task, metric, shown);
    fillCurves(task, metric, shown);
    fillBreakdowns(task, metric, shown);
  }
  if (by('frames').dataset.shown !== `${state.task} ${shown}`) fillFrames(task, shown);
  by('frames').dataset.shown = `${state.task} ${shown}`;
  const words = `#task=${encodeURIComponent(task.name)}&metric=${encodeURIComponent(state.metric)}`;
  if (change && location.hash !== words) history.replaceState(null, '', words);
  Object.assign(root.dataset, { state: 'ready', task: task.name, metric: state.metric });
}

function fillMetrics(task) {
  by('metric').replaceChildren(...task.metrics.map((metric) => new Option(withUnit(spaced(metric.name), metric.unit && `(${metric.unit})`), metric.name)));
}

function fillCurves(task, metric, shown) {
  const curves = Object.fromEntries(shown.map((k) => [k, (task.curves[k] || EMPTY)[metric.name] || EMPTY]));
  const factors = data.factors.filter((factor) => shown.some((k) => curves[k][factor.name]));
  by('curves').replaceChildren();
  by('curves-part').hidden = !data.factors.length;
  by('curves-hint').textContent = factors.length
    ? `Design: ${data.design}; ${data.how}. Means over rooms of the means over each room's frames, 95 % intervals over rooms, those of the effects wide enough for all factors and metrics together; all charts have the same vertical scale.`
    : 'This metric has no values by factor.';
  if (!factors.length) return;
  const range = rangeOf(curves, shown);
  for (const factor of factors) drawChart(by('curves'), factor, metric, Object.fromEntries(shown.map((k) => [k, curves[k][factor.name]])), shown, range);
}

function fillRuns() {
  data.evaluations.forEach((one, k) => {
    const box = element('details', null, by('runs'), 'card');
    box.open = true;
    const head = element('summary', null, box);
    key(k, head);
    element('span', one.title, head);
    const list = element('dl', null, box);
    for (const [name, text] of one.facts) {
      element('dt', name, list);
      element('dd', text, list);
    }
    if (one.command) commandLine(one.command, box);
  });
}

function fillLegend() {
  by('legend').hidden = data.evaluations.length < 2;
  data.evaluations.forEach((one, k) => {
    const button = element('button', null, by('legend'));
    button.type = 'button';
    button.setAttribute('aria-pressed', true);
    key(k, button);
    element('span', one.title, button);
    button.addEventListener('click', () => {
      if (!state.hidden.delete(k) && visible().length > 1) state.hidden.add(k);
      button.setAttribute('aria-pressed', !state.hidden.has(k));
      show({});
    });
  });
}

function followAddress() {
  const words = new URLSearchParams(location.hash.slice(1));
  const task = data.tasks.findIndex((one) => one.name === words.get('task'));
  if (words.get('task') && task >= 0) show({ task, metric: words.get('metric') || '' });
}

function start() {
  by('title').textContent = data.title;
  by('summary').textContent = [plural(data.evaluations.length, 'evaluation'), plural(data.tasks.length, 'task'), plural(data.factors.length, 'factor')].join(', ');
  if (data.notes.length) {
    by('notes').hidden = false;
    by('notes').querySelector('summary').textContent = plural(data.notes.length, 'note');
    data.notes.forEach((line) => element('li', line, by('notes').querySelector('ul')));
  }
  by('task').replaceChildren(...data.tasks.map((task, k) => new Option(spaced(task.name), k)));
  by('task').addEventListener('change', () => show({ task: Number(by('task').value), metric: '' }));
  by('metric').addEventListener('change', () => show({ metric: by('metric').value }));
  window.addEventListener('hashchange', followAddress);
  fillRuns();
  fillLegend();
  show();
  followAddress();
  root.dataset.state = 'ready';
}

start();
