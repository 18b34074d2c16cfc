// Puts the views together.
function legend() {
  const { ramp, low, high, more } = colourScale(state.quantity);
  const { unit } = quantity(state.quantity);
  const bar = element('i');
  bar.style.background = gradient(ramp);
  const sign = low < 0 ? '+' : '';
  byId('legend').replaceChildren(`${short(low)} ${unit}`, bar, `${sign}${short(high)} ${unit}${more ? ' and more' : ''}`);
}

/** Runs along the path in twelve seconds, in the proportions of the time it takes. */
function player(button, slider) {
  const time = SAMPLES.after_s;
  const whole = Math.max(time[COUNT - 1], 1e-9);
  let started = null;
  const sampleAt = (seconds) => {
    const found = time.findIndex((end) => end >= seconds);
    return found < 0 ? COUNT - 1 : found;
  };
  const stop = () => {
    started = null;
    button.textContent = 'play';
  };
  function step(now) {
    if (started === null) return;
    const share = Math.min((now - started) / 12000, 1);
    slider.value = 1000 * share;
    const i = sampleAt(share * whole);
    change({ sample: i, until: i });
    if (share < 1) requestAnimationFrame(step);
    else stop();
  }
  button.addEventListener('click', () => {
    if (started !== null) return stop();
    const from = Number(slider.value) >= 1000 ? 0 : Number(slider.value) / 1000;
    started = performance.now() - 12000 * from;
    button.textContent = 'pause';
    requestAnimationFrame(step);
  });
  slider.addEventListener('input', () => {
    stop();
    const i = sampleAt((slider.value / 1000) * whole);
    change({ sample: i, until: i });
  });
}

function tabs(space) {
  const [flat, deep] = [byId('show-above'), byId('show-space')];
  const select = (isSpace) => {
    byId('above').hidden = isSpace;
    byId('space').hidden = !isSpace;
    byId('stock-choice').hidden = !isSpace || !DATA.stock.length;
    byId('no-stock').hidden = !isSpace || DATA.stock.length > 0;
    flat.setAttribute('aria-pressed', String(!isSpace));
    deep.setAttribute('aria-pressed', String(isSpace));
    soon(redraw);
  };
  flat.addEventListener('click', () => select(false));
  deep.addEventListener('click', () => select(true));
  if (!space) {
    deep.disabled = true;
    byId('no-space').hidden = false;
  }
  select(false);
}

let views = [];
function redraw() {
  views.forEach((view) => view.draw());
}

function chooser() {
  const box = byId('quantity');
  for (const { key, label, unit } of quantities()) box.append(element('option', `${label}, ${unit}`, { value: key }));
  box.value = state.quantity;
  box.addEventListener('change', () => change({ quantity: box.value }));
  byId('axis').addEventListener('change', (event) => change({ axis: event.target.value }));
}

function start() {
  if (!COUNT) return;
  for (const part of document.querySelectorAll('.needs-script')) part.hidden = false;
  for (const part of document.querySelectorAll('.without-script')) part.hidden = true;
  chooser();
  const space = spaceView(byId('space'));
  views = [aboveView(byId('above')), curvesView(byId('curves-canvas')), listingView(byId('listing'))];
  if (space) views.push(space);
  tabs(space);
  player(byId('play'), byId('until'));
  byId('with-stock').addEventListener('change', (event) => {
    space?.show({ stock: event.target.checked });
    soon(redraw);
  });
  onChange((what) => {
    legend();
    if (state.sample >= 0) fill(byId('here'), state.sample);
    if (what.sample === undefined || what.until !== undefined || what.quantity) soon(redraw);
    else views.slice(0, 2).concat(space ? [space] : []).forEach((view) => soon(view.draw));
  });
  legend();
  redraw();
  addEventListener('resize', () => soon(redraw));
  matchMedia('(prefers-color-scheme: dark)').addEventListener('change', () => soon(redraw));
  addEventListener('beforeprint', () => {
    document.querySelectorAll('details').forEach((one) => (one.open = true));
    redraw();
  });
  document.documentElement.dataset.drawn = 'yes';
}

start();
