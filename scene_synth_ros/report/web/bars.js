// Scores, the ranking of the factors and the breakdowns: tables, with bars where values are compared.

function fillScores(task, shown, choose) {
  const several = data.evaluations.length > 1;
  const heads = ['metric', 'better', ...shown.map((k) => data.evaluations[k].title)];
  const others = several ? shown.filter((k) => k !== 0) : [];
  others.forEach((k) => heads.push(`${data.evaluations[k].title} minus first`));
  const rows = task.metrics.map((metric) => {
    const found = task.scores[metric.name] || EMPTY;
    const verdict = ([, low, high]) => {
      if (low === null || (low <= 0 && high >= 0)) return 'unsure';
      return high < 0 === metric.lower ? 'better' : 'worse';
    };
    return [
      (cell) => {
        const button = element('button', withUnit(spaced(metric.name), metric.unit && `(${metric.unit})`), cell, 'object');
        button.type = 'button';
        button.setAttribute('aria-pressed', metric.name === state.metric);
        button.addEventListener('click', () => choose(metric.name));
      },
      metric.lower ? 'lower' : 'higher',
      ...shown.map((k) => (found[k] ? sayInterval(found[k].score) : NONE)),
      ...others.map((k) => (cell) => {
        const apart = found[k] && found[k].difference;
        cell.textContent = apart ? `${sayInterval(apart)} ${{ unsure: '', better: '▲ better', worse: '▼ worse' }[verdict(apart)]}` : NONE;
        if (apart) cell.classList.add(verdict(apart));
      }),
    ];
  });
  const lines = fillTable(by('scores'), heads, rows, [], 'no metrics');
  lines.forEach((line, k) => line.classList.toggle('chosen', task.metrics[k].name === state.metric));
  by('scores-hint').textContent = `with 95 % intervals over rooms${others.length ? '; differences are those of the means of frames, paired within rooms' : ''}`;
}

function fillRanking(task, metric, shown) {
  const found = Object.fromEntries(shown.map((k) => [k, (task.ranking[k] || EMPTY)[metric.name]]).filter(([, part]) => part));
  const hypercube = data.design === 'latin hypercube';
  by('ranking-part').hidden = !data.factors.length;
  by('ranking').replaceChildren();
  const first = Object.values(found)[0];
  if (!first) {
    by('ranking-hint').textContent = 'Single frames have no values of this metric, so its effects cannot be paired within rooms; see the curves.';
    return;
  }
  const explained = Object.entries(found).map(([k, part]) => (part.explained === null ? '' : `${data.evaluations[k].title}: ${say(100 * part.explained)} %`)).filter(Boolean);
  by('ranking-hint').textContent = hypercube
    ? `Effect: standardised coefficient of a linear fit of all factors at once, within rooms, so 0 is no effect and 1 that the factor alone explains all change. The fit explains ${explained.join(', ')} of the variance.`
    : `Effect: how far the means at a factor's values lie apart, each taken as a difference to the base (or to the room's mean where there is none) in the same room; where the interval holds 0 the effect is not sure.`;
  const rows = first.rows.map((row) => {
    const own = Object.fromEntries(Object.entries(found).map(([k, part]) => [k, part.rows.find((one) => one.factor === row.factor)]).filter(([, one]) => one));
    const factor = data.factors.find((one) => one.name === row.factor);
    const texts = (text) => Object.fromEntries(Object.entries(own).map(([k, one]) => [k, text(one)]));
    const shares = texts((one) => (one.share === null ? NONE : `${say(Math.round(1000 * one.share) / 10)} %`));
    const unit = factor.places.length ? factor.unit : '';
    const ends = texts((one) => (one.effect[0] ? `${withUnit(one.least, unit)} → ${withUnit(one.most, unit)}` : NONE));
    return [factor.label, Object.fromEntries(Object.entries(own).map(([k, one]) => [k, one.effect])), ...(hypercube ? [] : [shares, ends])];
  });
  const heads = hypercube ? ['factor', 'coefficient'] : ['factor', 'effect', 'of the base', 'smallest → largest at'];
  barTable(element('div', null, by('ranking'), 'scroll'), heads, rows, hypercube ? '' : metric.unit, shown);
}

function fillBreakdowns(task, metric, shown) {
  const kinds = task.breakdowns[metric.name] || EMPTY;
  by('breakdowns').replaceChildren();
  by('breakdowns-hint').textContent = Object.keys(kinds).length ? `Worst first${kinds.distance ? ', distances in their order' : ''}; 95 % intervals over rooms.` : 'The evaluation has no breakdown of this metric.';
  for (const [kind, heading] of Object.entries(data.kinds)) {
    if (!kinds[kind]) continue;
    const box = element('div', null, by('breakdowns'), 'scroll card');
    barTable(box, [`by ${heading}`, spaced(metric.name)], kinds[kind].map((row) => [row.key, row.values]), metric.unit, shown);
  }
}
