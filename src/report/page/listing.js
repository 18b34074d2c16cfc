// The program, line by line, as it was and as it is written. Only rows in sight are in the document: a program may have a million lines.
function listingView(box) {
  const all = [];
  for (const [line, old, news] of DATA.listing) {
    const written = news ?? [old];
    all.push({ line, old, new: written[0] ?? '', changed: news !== null });
    for (const more of written.slice(1)) all.push({ line, old: '', new: more, changed: true });
  }
  let rows = all;
  const inner = element('div');
  box.append(inner);
  const rowHeight = () => (matchMedia('(max-width:700px)').matches ? 40 : 20);

  function row(k) {
    const { line, old, changed } = rows[k];
    const here = state.sample >= 0 && SAMPLES.line[state.sample] === line;
    const made = element('div', undefined, { class: `row${changed ? ' changed' : ''}${here ? ' here' : ''}`, 'data-line': line });
    made.append(element('span', line, { class: 'n' }), element('span', old), element('span', rows[k].new, { class: 'new' }));
    made.style.top = `${k * rowHeight()}px`;
    return made;
  }

  function draw() {
    const high = rowHeight();
    inner.style.height = `${rows.length * high}px`;
    const first = Math.max(0, Math.floor(box.scrollTop / high) - 10);
    const last = Math.min(rows.length, Math.ceil((box.scrollTop + box.clientHeight) / high) + 10);
    inner.replaceChildren(...Array.from({ length: Math.max(0, last - first) }, (_, k) => row(first + k)));
  }

  function scrollTo(k) {
    if (k >= 0) box.scrollTop = Math.max(0, k * rowHeight() - box.clientHeight / 2);
    soon(draw);
  }

  /** Chooses the next changed row after (1) or before (-1) the one that is chosen. */
  function nextChange(step) {
    const line = state.sample >= 0 ? SAMPLES.line[state.sample] : 0;
    const changed = rows.map((one) => one.line).filter((_, k) => rows[k].changed);
    const found = step > 0 ? changed.find((one) => one > line) : changed.findLast((one) => one < line);
    if (found !== undefined) chooseLine(found);
  }

  function chooseLine(line) {
    const found = sampleOfLine(line);
    if (found >= 0) change({ sample: found });
    scrollTo(rows.findIndex((one) => one.line === line));
  }

  box.addEventListener('scroll', () => soon(draw));
  box.addEventListener('click', (event) => {
    const line = event.target.closest('.row')?.dataset.line;
    const found = line ? sampleOfLine(Number(line)) : -1;
    if (found >= 0) change({ sample: found });
  });
  byId('only-changed').addEventListener('change', (event) => {
    rows = event.target.checked ? all.filter((one) => one.changed) : all;
    box.scrollTop = 0;
    soon(draw);
  });
  byId('next-change').addEventListener('click', () => nextChange(1));
  byId('previous-change').addEventListener('click', () => nextChange(-1));
  onChange((what) => {
    if (what.sample === undefined) return;
    const high = rowHeight();
    const k = what.sample < 0 ? -1 : rows.findIndex((one) => one.line === SAMPLES.line[what.sample]);
    const inSight = k * high >= box.scrollTop && (k + 1) * high <= box.scrollTop + box.clientHeight;
    if (inSight) soon(draw);
    else scrollTo(k);
  });
  return { draw };
}
