// Feed, and a load, over the path or over time: as programmed in grey, as written in blue, the limit dashed and always in view. Bands
// in the background are the operations. The wheel zooms along the path, drag moves it.
function curvesView(canvas) {
  const LEFT = 66;
  const RIGHT = 12;
  let span = [0, 1];
  let drag = null;
  let moved = false;

  const ends = () => (state.axis === 'path' ? SAMPLES.s : SAMPLES.after_s);
  const whole = () => Math.max(ends()[COUNT - 1] || 0, 1e-9);
  const shown = () => {
    const own = quantity(state.quantity);
    return own.key === 'feed' || own.key === 'change' ? DATA.loads[0] : own;
  };

  function frame(size) {
    const high = (size.height - 74) / 2;
    return [{ top: 34, high }, { top: 34 + high + 22, high }].map((panel) => ({ ...panel, left: LEFT, wide: size.width - LEFT - RIGHT }));
  }
  const xOf = (panel, value) => panel.left + (panel.wide * (value / whole() - span[0])) / (span[1] - span[0]);

  /** Least and largest value of a column in each pixel. */
  function columns(panel, values) {
    const at = ends();
    const found = Array.from({ length: Math.ceil(panel.wide) + 1 }, () => [Infinity, -Infinity]);
    for (let i = 0; i < COUNT; i++) {
      if (SAMPLES.rapid[i]) continue;
      const from = Math.floor(xOf(panel, i ? at[i - 1] : 0) - panel.left);
      const to = Math.floor(xOf(panel, at[i]) - panel.left);
      for (let k = Math.max(0, from); k <= Math.min(found.length - 1, to); k++) {
        found[k][0] = Math.min(found[k][0], values[i]);
        found[k][1] = Math.max(found[k][1], values[i]);
      }
    }
    return found;
  }

  function curve(pen, panel, values, colour, top) {
    const y = (value) => panel.top + panel.high * (1 - Math.min(value / top, 1));
    pen.strokeStyle = colour;
    pen.lineWidth = 1.4;
    pen.beginPath();
    let last = null;
    columns(panel, values).forEach(([low, high], k) => {
      if (high < low) return (last = null);
      const px = panel.left + k;
      if (last === null) pen.moveTo(px, y(low));
      else pen.lineTo(px, y(Math.abs(last - low) < Math.abs(last - high) ? low : high));
      pen.lineTo(px, y(low));
      pen.lineTo(px, y(high));
      last = (low + high) / 2;
    });
    pen.stroke();
  }

  function limits(pen, panel, column, top) {
    if (!column) return;
    pen.strokeStyle = themeColour('--limit');
    pen.setLineDash([8, 5]);
    pen.lineWidth = 1.6;
    pen.beginPath();
    let before = null;
    const at = ends();
    for (let i = 0; i < COUNT; i++) {
      const value = column[i];
      const y = panel.top + panel.high * (1 - value / top);
      if (value === null) { before = null; continue; }
      if (value !== before) pen.moveTo(xOf(panel, i ? at[i - 1] : 0), y);
      pen.lineTo(xOf(panel, at[i]), y);
      before = value;
    }
    pen.stroke();
    pen.setLineDash([]);
  }

  function bands(pen, panel, named) {
    const at = ends();
    let from = 0;
    for (let i = 1; i <= COUNT; i++) {
      if (i < COUNT && SAMPLES.operation[i] === SAMPLES.operation[from]) continue;
      const [a, b] = [xOf(panel, from ? at[from - 1] : 0), xOf(panel, at[i - 1])];
      const number = SAMPLES.operation[from];
      if (number % 2) {
        pen.fillStyle = themeColour('--band');
        pen.fillRect(a, panel.top, b - a, panel.high);
      }
      if (named && b - a > 40) {
        pen.fillStyle = themeColour('--soft');
        pen.save();
        pen.beginPath();
        pen.rect(a, 0, b - a - 4, panel.top);
        pen.clip();
        pen.textAlign = 'left';
        pen.fillText(DATA.operations[number].name, Math.max(a, panel.left) + 3, 12);
        pen.restore();
      }
      from = i;
    }
  }

  function axes(pen, panel, top, label) {
    pen.fillStyle = themeColour('--soft');
    pen.strokeStyle = themeColour('--line');
    pen.lineWidth = 1;
    for (let k = 0; k <= 4; k++) {
      const y = panel.top + panel.high * (1 - k / 4);
      pen.beginPath();
      pen.moveTo(panel.left, y);
      pen.lineTo(panel.left + panel.wide, y);
      pen.stroke();
      pen.textAlign = 'right';
      pen.fillText(short((top * k) / 4), panel.left - 6, y + 4);
    }
    pen.textAlign = 'left';
    pen.fillStyle = themeColour('--ink');
    pen.fillText(label, panel.left + 4, panel.top - 6);
  }

  function drawPanel(pen, panel, one, named) {
    const [before, after] = [columnOf(one.key, 'before'), columnOf(one.key, 'after')];
    const limit = limitColumn(one.key);
    const top = roundUp(1.04 * largest([largest(before), largest(after), limit ? largest(limit) : 0], 1e-9));
    pen.save();
    pen.beginPath();
    pen.rect(panel.left, 0, panel.wide, 4000);
    pen.clip();
    bands(pen, panel, named);
    pen.restore();
    axes(pen, panel, top, `${one.label}, ${one.unit}`);
    pen.save();
    pen.beginPath();
    pen.rect(panel.left, panel.top - 2, panel.wide, panel.high + 4);
    pen.clip();
    if (DATA.rewritten) curve(pen, panel, before, themeColour('--before'), top);
    curve(pen, panel, after, themeColour(DATA.rewritten ? '--after' : '--before'), top);
    limits(pen, panel, limit, top);
    if (state.sample >= 0) {
      pen.fillStyle = themeColour('--ink');
      pen.fillRect(xOf(panel, ends()[state.sample]) - 1, panel.top, 2, panel.high);
    }
    pen.restore();
  }

  function draw() {
    const size = fitCanvas(canvas);
    const pen = canvas.getContext('2d');
    pen.setTransform(size.scale, 0, 0, size.scale, 0, 0);
    pen.clearRect(0, 0, size.width, size.height);
    pen.font = '12px system-ui,Helvetica,Arial,sans-serif';
    const [upper, lower] = frame(size);
    drawPanel(pen, upper, quantity('feed'), true);
    if (shown()) drawPanel(pen, lower, shown(), false);
    pen.fillStyle = themeColour('--soft');
    const [from, to] = span.map((t) => t * whole());
    const text = (value) => (state.axis === 'path' ? `${short(value)} ${DATA.unit_length}` : clock(value));
    pen.textAlign = 'left';
    pen.fillText(text(from), LEFT, size.height - 4);
    pen.textAlign = 'right';
    pen.fillText(text(to), size.width - RIGHT, size.height - 4);
    pen.textAlign = 'center';
    pen.fillText(state.axis === 'path' ? 'along the feed moves' : 'time of the shown feeds', size.width / 2, size.height - 4);
  }

  /** The sample at a place of the screen. */
  function under(event) {
    const rect = canvas.getBoundingClientRect();
    const share = (event.clientX - rect.left - LEFT) / (rect.width - LEFT - RIGHT);
    if (share < 0 || share > 1) return -1;
    const value = (span[0] + share * (span[1] - span[0])) * whole();
    const at = ends();
    let [low, high] = [0, COUNT - 1];
    while (low < high) {
      const middle = (low + high) >> 1;
      if (at[middle] < value) low = middle + 1;
      else high = middle;
    }
    return low;
  }

  function put(from, width) {
    const wide = Math.min(Math.max(width, 1e-4), 1);
    const start = Math.min(Math.max(from, 0), 1 - wide);
    span = [start, start + wide];
    soon(draw);
  }

  canvas.addEventListener('wheel', (event) => {
    event.preventDefault();
    const rect = canvas.getBoundingClientRect();
    const share = (event.clientX - rect.left - LEFT) / (rect.width - LEFT - RIGHT);
    const [width, factor] = [span[1] - span[0], Math.exp(0.0015 * event.deltaY)];
    put(span[0] + share * width * (1 - factor), width * factor);
  }, { passive: false });
  canvas.addEventListener('pointerdown', (event) => {
    drag = { x: event.clientX, from: span[0] };
    moved = false;
    canvas.setPointerCapture(event.pointerId);
  });
  canvas.addEventListener('pointermove', (event) => {
    if (!drag) return showTip(under(event), event);
    const dx = event.clientX - drag.x;
    if (Math.abs(dx) > 3) moved = true;
    if (moved) put(drag.from - (dx / (canvas.clientWidth - LEFT - RIGHT)) * (span[1] - span[0]), span[1] - span[0]);
  });
  canvas.addEventListener('pointerup', () => (drag = null));
  canvas.addEventListener('pointercancel', () => (drag = null));
  canvas.addEventListener('pointerleave', () => showTip(-1));
  canvas.addEventListener('click', (event) => {
    const found = moved ? -1 : under(event);
    if (found >= 0) change({ sample: found });
  });
  canvas.addEventListener('dblclick', () => put(0, 1));
  return { draw };
}
