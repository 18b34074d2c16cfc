// The path from above, on a plain canvas: needs nothing but a browser. Drag moves it, the wheel or two fingers zoom.
function aboveView(canvas) {
  const { x, y } = DATA.points;
  const box = DATA.box;
  const boxes = sampleBoxes();
  let view = null;
  let drag = null;
  let moved = false;
  const fingers = new Map();

  function fit(width, height) {
    const wide = Math.max(box.max[0] - box.min[0], 1e-6);
    const high = Math.max(box.max[1] - box.min[1], 1e-6);
    const zoom = 0.92 * Math.min(width / wide, height / high);
    view = { zoom, x: (box.min[0] + box.max[0]) / 2, y: (box.min[1] + box.max[1]) / 2 };
  }

  const place = (k, size) => [size.width / 2 + (x[k] - view.x) * view.zoom, size.height / 2 - (y[k] - view.y) * view.zoom];

  function trace(path, i, size) {
    path.moveTo(...place(SAMPLES.p0[i], size));
    for (let k = SAMPLES.p0[i] + 1; k <= SAMPLES.p1[i]; k++) path.lineTo(...place(k, size));
  }

  /** One path for each of 48 colours: a canvas is slow where the colour changes often. */
  function coloured(size) {
    const { low, high } = colourScale(state.quantity);
    const values = columnOf(state.quantity, 'after');
    const paths = Array.from({ length: 48 }, () => new Path2D());
    for (let i = 0; i <= state.until; i++) {
      if (SAMPLES.rapid[i]) continue;
      const share = (values[i] - low) / (high - low || 1);
      trace(paths[Math.min(47, Math.max(0, Math.floor(share * 48)))], i, size);
    }
    return paths;
  }

  function drawStock(pen, size) {
    pen.strokeStyle = themeColour('--soft');
    pen.setLineDash([6, 4]);
    for (const piece of DATA.stock) {
      const [left, top] = [size.width / 2 + (piece.min[0] - view.x) * view.zoom, size.height / 2 - (piece.max[1] - view.y) * view.zoom];
      pen.strokeRect(left, top, (piece.max[0] - piece.min[0]) * view.zoom, (piece.max[1] - piece.min[1]) * view.zoom);
    }
    pen.setLineDash([]);
  }

  function drawMarker(pen, size) {
    if (state.sample < 0) return;
    const [px, py] = place(SAMPLES.p1[state.sample], size);
    pen.beginPath();
    pen.arc(px, py, 7, 0, 7);
    pen.strokeStyle = themeColour('--ink');
    pen.lineWidth = 3;
    pen.stroke();
  }

  function draw() {
    if (!canvas.clientWidth) return;
    const size = fitCanvas(canvas);
    if (!view) fit(size.width, size.height);
    const pen = canvas.getContext('2d');
    pen.setTransform(size.scale, 0, 0, size.scale, 0, 0);
    pen.clearRect(0, 0, size.width, size.height);
    pen.lineJoin = 'round';
    drawStock(pen, size);
    const rapids = new Path2D();
    for (let i = 0; i <= state.until; i++) if (SAMPLES.rapid[i]) trace(rapids, i, size);
    pen.lineWidth = 0.6;
    pen.strokeStyle = themeColour('--line');
    pen.stroke(rapids);
    pen.lineWidth = 2.2;
    const { ramp } = colourScale(state.quantity);
    coloured(size).forEach((path, k) => {
      pen.strokeStyle = cssColour(rampColour(ramp, (k + 0.5) / 48));
      pen.stroke(path);
    });
    drawMarker(pen, size);
  }

  /** The sample under a place of the screen, within 14 pixels; -1 where there is none. Boxes of samples that lie apart are passed over. */
  function under(event) {
    if (!view) return -1;
    const rect = canvas.getBoundingClientRect();
    const px = view.x + (event.clientX - rect.left - rect.width / 2) / view.zoom;
    const py = view.y + (rect.height / 2 - (event.clientY - rect.top)) / view.zoom;
    const reach = 14 / view.zoom;
    let [best, found] = [reach * reach, -1];
    for (let i = 0; i <= state.until; i++) {
      if (SAMPLES.rapid[i] || isApart(boxes, 4 * i, px, py, reach)) continue;
      for (let k = SAMPLES.p0[i]; k < SAMPLES.p1[i]; k++) {
        const apart = distance2(px, py, x[k], y[k], x[k + 1], y[k + 1]);
        if (apart <= best) [best, found] = [apart, i];
      }
    }
    return found;
  }

  function zoomBy(factor, event) {
    const rect = canvas.getBoundingClientRect();
    const [dx, dy] = [event.clientX - rect.left - rect.width / 2, rect.height / 2 - (event.clientY - rect.top)];
    view.x += (dx / view.zoom) * (1 - 1 / factor);
    view.y += (dy / view.zoom) * (1 - 1 / factor);
    view.zoom *= factor;
    soon(draw);
  }

  canvas.addEventListener('wheel', (event) => {
    event.preventDefault();
    zoomBy(Math.exp(-0.0015 * event.deltaY), event);
  }, { passive: false });
  canvas.addEventListener('pointerdown', (event) => {
    fingers.set(event.pointerId, [event.clientX, event.clientY]);
    drag = [event.clientX, event.clientY];
    moved = false;
    canvas.setPointerCapture(event.pointerId);
  });
  canvas.addEventListener('pointermove', (event) => {
    if (!fingers.has(event.pointerId)) return showTip(under(event), event);
    if (fingers.size === 2) {
      const before = spread(fingers);
      fingers.set(event.pointerId, [event.clientX, event.clientY]);
      return zoomBy(spread(fingers) / before, event);
    }
    const [dx, dy] = [event.clientX - drag[0], event.clientY - drag[1]];
    if (Math.abs(dx) + Math.abs(dy) > 3) moved = true;
    if (!moved) return;
    view.x -= dx / view.zoom;
    view.y += dy / view.zoom;
    drag = [event.clientX, event.clientY];
    showTip(-1);
    soon(draw);
  });
  const release = (event) => fingers.delete(event.pointerId);
  canvas.addEventListener('pointerup', release);
  canvas.addEventListener('pointercancel', release);
  canvas.addEventListener('pointerleave', () => showTip(-1));
  canvas.addEventListener('click', (event) => {
    const found = moved ? -1 : under(event);
    if (found >= 0) change({ sample: found });
  });
  canvas.addEventListener('dblclick', () => {
    view = null;
    soon(draw);
  });
  return { draw };
}

/** Distance of two fingers. */
function spread(fingers) {
  const [a, b] = [...fingers.values()];
  return Math.max(Math.hypot(a[0] - b[0], a[1] - b[1]), 1);
}

/** Squared distance of a place from a stretch. */
function distance2(px, py, ax, ay, bx, by) {
  const dx = bx - ax;
  const dy = by - ay;
  const length2 = dx * dx + dy * dy;
  const t = length2 > 0 ? Math.min(1, Math.max(0, ((px - ax) * dx + (py - ay) * dy) / length2)) : 0;
  return (px - ax - t * dx) ** 2 + (py - ay - t * dy) ** 2;
}

/** Least x, least y, largest x, largest y of each sample. */
function sampleBoxes() {
  const { x, y } = DATA.points;
  const boxes = new Float64Array(4 * COUNT);
  for (let i = 0; i < COUNT; i++) {
    boxes.set([Infinity, Infinity, -Infinity, -Infinity], 4 * i);
    for (let k = SAMPLES.p0[i]; k <= SAMPLES.p1[i]; k++) {
      boxes[4 * i] = Math.min(boxes[4 * i], x[k]);
      boxes[4 * i + 1] = Math.min(boxes[4 * i + 1], y[k]);
      boxes[4 * i + 2] = Math.max(boxes[4 * i + 2], x[k]);
      boxes[4 * i + 3] = Math.max(boxes[4 * i + 3], y[k]);
    }
  }
  return boxes;
}

function isApart(boxes, at, px, py, reach) {
  return px < boxes[at] - reach || py < boxes[at + 1] - reach || px > boxes[at + 2] + reach || py > boxes[at + 3] + reach;
}
