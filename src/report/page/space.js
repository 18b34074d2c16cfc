// Path and stock in space, with plain WebGL2. Drag turns, shift-drag or the right button moves, the wheel zooms. Every stretch of
// the path is a strip that is a few pixels wide from every side; the stock is the height field as the program leaves it.
const STRIP_VERTEX = `#version 300 es
layout(location=0) in vec3 a; layout(location=1) in vec3 b; layout(location=2) in vec2 info; layout(location=3) in vec2 corner;
uniform mat4 view; uniform vec2 pixels; uniform float until; uniform float width;
out float value; flat out float kind;
void main() {
  vec4 p = view * vec4(a, 1.0), q = view * vec4(b, 1.0);
  vec2 along = (q.xy / q.w - p.xy / p.w) * pixels;
  along = length(along) > 1e-6 ? normalize(along) : vec2(1.0, 0.0);
  vec4 at = mix(p, q, corner.x);
  vec2 off = (vec2(-along.y, along.x) * corner.y + along * (corner.x * 2.0 - 1.0) * 0.5) * width * (info.x < 0.0 ? 0.5 : 1.0);
  at.xy += off / pixels * 2.0 * at.w;
  at.z -= 0.0005 * at.w;
  value = info.x; kind = info.x;
  gl_Position = info.y > until ? vec4(2.0, 2.0, 2.0, 1.0) : at;
}`;
const STRIP_FRAGMENT = `#version 300 es
precision highp float;
in float value; flat in float kind; uniform vec3 ramp[9]; uniform vec3 faint; out vec4 colour;
void main() {
  if (kind < 0.0) { colour = vec4(faint, 1.0); return; }
  float at = clamp(value, 0.0, 1.0) * 8.0;
  int low = min(int(at), 7);
  colour = vec4(mix(ramp[low], ramp[low + 1], at - float(low)), 1.0);
}`;
const BODY_VERTEX = `#version 300 es
layout(location=0) in vec3 at; layout(location=1) in vec3 normal;
uniform mat4 view; uniform vec3 shift; uniform vec3 size; out vec3 n;
void main() { n = normal; gl_Position = view * vec4(at * size + shift, 1.0); }`;
const BODY_FRAGMENT = `#version 300 es
precision highp float;
in vec3 n; uniform vec4 tint; out vec4 colour;
void main() {
  vec3 m = normalize(n);
  float light = 0.45 + 0.35 * abs(dot(m, normalize(vec3(-0.4, -0.6, 0.8)))) + 0.2 * max(m.z, 0.0);
  colour = vec4(tint.rgb * light, tint.a);
}`;

/** The view in space; `null` where the browser has no WebGL2. */
function spaceView(canvas) {
  const gl = canvas.getContext('webgl2', { antialias: true, preserveDrawingBuffer: true });
  if (!gl) return null;
  const strips = program(gl, STRIP_VERTEX, STRIP_FRAGMENT);
  const body = program(gl, BODY_VERTEX, BODY_FRAGMENT);
  const path = stripArrays(gl);
  const stock = DATA.stock.map((piece) => bodyArrays(gl, reliefTriangles(piece)));
  const tool = bodyArrays(gl, cylinderTriangles(32));
  const eye = { turn: -0.9, tilt: 0.95, zoom: 1.3, x: 0, y: 0 };
  let coloured = null;
  let drag = null;
  const spaceState = { stock: true };

  function colourPath() {
    const { low, high } = colourScale(state.quantity);
    const values = columnOf(state.quantity, 'after');
    path.owner.forEach((i, k) => {
      path.info[2 * k] = SAMPLES.rapid[i] ? -1 : (values[i] - low) / (high - low || 1);
    });
    gl.bindBuffer(gl.ARRAY_BUFFER, path.infoBuffer);
    gl.bufferData(gl.ARRAY_BUFFER, path.info, gl.DYNAMIC_DRAW);
    coloured = state.quantity;
  }

  function drawPath(view, size) {
    if (coloured !== state.quantity) colourPath();
    gl.useProgram(strips.program);
    gl.uniformMatrix4fv(strips.at('view'), false, view);
    gl.uniform2f(strips.at('pixels'), size.width, size.height);
    gl.uniform1f(strips.at('until'), state.until);
    gl.uniform1f(strips.at('width'), 1.6);
    gl.uniform3fv(strips.at('ramp'), colourScale(state.quantity).ramp.flat().map((part) => part / 255));
    gl.uniform3fv(strips.at('faint'), rgb(themeColour('--line')));
    gl.bindVertexArray(path.array);
    gl.drawArraysInstanced(gl.TRIANGLE_STRIP, 0, 4, path.owner.length);
  }

  function drawBody(arrays, view, shift, size, tint) {
    gl.useProgram(body.program);
    gl.uniformMatrix4fv(body.at('view'), false, view);
    gl.uniform3fv(body.at('shift'), shift);
    gl.uniform3fv(body.at('size'), size);
    gl.uniform4fv(body.at('tint'), tint);
    gl.bindVertexArray(arrays.array);
    gl.drawArrays(gl.TRIANGLES, 0, arrays.count);
  }

  function drawTool(view) {
    if (state.sample < 0) return;
    const k = SAMPLES.p1[state.sample];
    const own = DATA.tools.find((one) => one.number === SAMPLES.tool[state.sample]);
    const radius = own ? own.diameter / 2 : 0.01 * boxSize();
    const tip = [DATA.points.x[k], DATA.points.y[k], DATA.points.z[k]];
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);
    drawBody(tool, view, tip, [radius, radius, own ? own.length : 6 * radius], [0.9, 0.75, 0.2, 0.55]);
    gl.disable(gl.BLEND);
  }

  function draw() {
    if (!canvas.clientWidth) return;
    const size = fitCanvas(canvas);
    gl.viewport(0, 0, canvas.width, canvas.height);
    const paper = rgb(themeColour('--paper'));
    gl.clearColor(...paper, 1);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.enable(gl.DEPTH_TEST);
    const view = viewMatrix(eye, size);
    const tint = [0.62, 0.66, 0.7, 1];
    if (spaceState.stock) stock.forEach((arrays) => drawBody(arrays, view, [0, 0, 0], [1, 1, 1], tint));
    drawPath(view, size);
    drawTool(view);
  }

  canvas.addEventListener('contextmenu', (event) => event.preventDefault());
  canvas.addEventListener('pointerdown', (event) => {
    drag = { x: event.clientX, y: event.clientY, moves: event.shiftKey || event.button === 2 };
    canvas.setPointerCapture(event.pointerId);
  });
  canvas.addEventListener('pointermove', (event) => {
    if (!drag) return;
    const [dx, dy] = [event.clientX - drag.x, event.clientY - drag.y];
    Object.assign(drag, { x: event.clientX, y: event.clientY });
    if (drag.moves) {
      eye.x += (2 * dx) / canvas.clientWidth;
      eye.y -= (2 * dy) / canvas.clientHeight;
    } else {
      eye.turn += 0.008 * dx;
      eye.tilt = Math.min(Math.PI / 2, Math.max(-Math.PI / 2, eye.tilt + 0.008 * dy));
    }
    soon(draw);
  });
  for (const name of ['pointerup', 'pointercancel']) canvas.addEventListener(name, () => (drag = null));
  canvas.addEventListener('wheel', (event) => {
    event.preventDefault();
    eye.zoom *= Math.exp(-0.0015 * event.deltaY);
    soon(draw);
  }, { passive: false });
  return { draw, turn: (by) => (eye.turn += by), show: (what) => Object.assign(spaceState, what) };
}

function rgb(colour) {
  const hex = colour.length === 4 ? colour.replace(/[^#]/g, '$&$&') : colour;
  return [1, 3, 5].map((k) => parseInt(hex.slice(k, k + 2), 16) / 255);
}

function program(gl, vertex, fragment) {
  const made = gl.createProgram();
  for (const [kind, text] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, text);
    gl.compileShader(shader);
    gl.attachShader(made, shader);
  }
  gl.linkProgram(made);
  if (!gl.getProgramParameter(made, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(made));
  const places = new Map();
  const at = (name) => places.get(name) ?? places.set(name, gl.getUniformLocation(made, name)).get(name);
  return { program: made, at };
}

function attribute(gl, place, data, size, stride, offset, divisor, buffer) {
  gl.bindBuffer(gl.ARRAY_BUFFER, buffer ?? gl.createBuffer());
  if (data) gl.bufferData(gl.ARRAY_BUFFER, data, gl.STATIC_DRAW);
  gl.enableVertexAttribArray(place);
  gl.vertexAttribPointer(place, size, gl.FLOAT, false, stride, offset);
  gl.vertexAttribDivisor(place, divisor);
}

/** Every stretch between two points of the path: its ends, and which sample it belongs to. */
function stripArrays(gl) {
  const { x, y, z } = DATA.points;
  const [ends, owner] = [[], []];
  for (let i = 0; i < COUNT; i++) {
    for (let k = SAMPLES.p0[i]; k < SAMPLES.p1[i]; k++) {
      ends.push(x[k], y[k], z[k], x[k + 1], y[k + 1], z[k + 1]);
      owner.push(i);
    }
  }
  const array = gl.createVertexArray();
  gl.bindVertexArray(array);
  const buffer = gl.createBuffer();
  attribute(gl, 0, new Float32Array(ends), 3, 24, 0, 1, buffer);
  attribute(gl, 1, null, 3, 24, 12, 1, buffer);
  const info = new Float32Array(owner.flatMap((i) => [0, i]));
  const infoBuffer = gl.createBuffer();
  attribute(gl, 2, info, 2, 0, 0, 1, infoBuffer);
  attribute(gl, 3, new Float32Array([0, -1, 0, 1, 1, -1, 1, 1]), 2, 0, 0, 0);
  return { array, owner, info, infoBuffer };
}

function bodyArrays(gl, { at, normal }) {
  const array = gl.createVertexArray();
  gl.bindVertexArray(array);
  attribute(gl, 0, new Float32Array(at), 3, 0, 0, 0);
  attribute(gl, 1, new Float32Array(normal), 3, 0, 0, 0);
  return { array, count: at.length / 3 };
}

/** The top of a piece of stock and its sides, in flat triangles; what is cut through is left open. */
function reliefTriangles({ min, max, size: [nx, ny], heights }) {
  const [at, normal] = [[], []];
  const [dx, dy] = [(max[0] - min[0]) / nx, (max[1] - min[1]) / ny];
  const corner = (i, j) => [min[0] + (i + 0.5) * dx, min[1] + (j + 0.5) * dy, heights[j * nx + i]];
  const push = (a, b, c) => {
    const n = cross(minus(b, a), minus(c, a));
    at.push(...a, ...b, ...c);
    normal.push(...n, ...n, ...n);
  };
  for (let j = 0; j + 1 < ny; j++) {
    for (let i = 0; i + 1 < nx; i++) {
      const [a, b, c, d] = [corner(i, j), corner(i + 1, j), corner(i + 1, j + 1), corner(i, j + 1)];
      if (Math.max(a[2], b[2], c[2], d[2]) <= min[2] + 1e-6) continue;
      push(a, b, c);
      push(a, c, d);
    }
  }
  const side = (a, b) => {
    const [p, q] = [[a[0], a[1], min[2]], [b[0], b[1], min[2]]];
    push(a, p, b);
    push(b, p, q);
  };
  for (let i = 0; i + 1 < nx; i++) [0, ny - 1].forEach((j) => side(corner(i, j), corner(i + 1, j)));
  for (let j = 0; j + 1 < ny; j++) [0, nx - 1].forEach((i) => side(corner(i, j), corner(i, j + 1)));
  return { at, normal };
}

/** A cylinder of radius and height 1 on the origin. */
function cylinderTriangles(sides) {
  const [at, normal] = [[], []];
  for (let k = 0; k < sides; k++) {
    const [a, b] = [k, k + 1].map((m) => [Math.cos((2 * Math.PI * m) / sides), Math.sin((2 * Math.PI * m) / sides)]);
    at.push(...a, 0, ...b, 0, ...b, 1, ...a, 0, ...b, 1, ...a, 1, 0, 0, 0, ...b, 0, ...a, 0);
    for (const [x, y] of [a, b, b, a, b, a]) normal.push(x, y, 0);
    normal.push(0, 0, -1, 0, 0, -1, 0, 0, -1);
  }
  return { at, normal };
}

function minus(a, b) {
  return [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
}

function cross(a, b) {
  return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
}

function boxSize() {
  return Math.max(Math.hypot(...minus(DATA.box.max, DATA.box.min)), 1e-6);
}

/** From the part to the screen: about the middle of the box, turned, tilted, without perspective, as drawings are. Column by column. */
function viewMatrix(eye, { width, height }) {
  const middle = DATA.box.min.map((low, k) => (low + DATA.box.max[k]) / 2);
  const scale = (1.9 * eye.zoom) / boxSize();
  const [fx, fy] = width > height ? [height / width, 1] : [1, width / height];
  const [c, s, u, v] = [Math.cos(eye.turn), Math.sin(eye.turn), Math.cos(eye.tilt), Math.sin(eye.tilt)];
  const right = [c, -s, 0];
  const up = [s * v, c * v, u];
  const out = [-s * u, -c * u, v];
  const row = (axis, factor, shift) => [...axis.map((part) => part * factor), shift - factor * dot(axis, middle)];
  const rows = [row(right, scale * fx, eye.x), row(up, scale * fy, eye.y), row(out, -0.4 * scale / Math.max(eye.zoom, 1e-6), 0), [0, 0, 0, 1]];
  return new Float32Array([0, 1, 2, 3].flatMap((k) => rows.map((one) => one[k])));
}

function dot(a, b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}
