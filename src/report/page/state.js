// What is chosen, and who wants to hear of it.
const state = { quantity: DATA.rewritten ? 'change' : (DATA.loads[0]?.key ?? 'feed'), sample: -1, axis: 'path', until: COUNT - 1 };
const listeners = [];

/** Calls `hear` after every change of the state. */
function onChange(hear) {
  listeners.push(hear);
}

function change(what) {
  Object.assign(state, what);
  listeners.forEach((hear) => hear(what));
}

/** An element with text; text never becomes markup. */
function element(name, text, attributes = {}) {
  const made = document.createElement(name);
  if (text !== undefined) made.textContent = text;
  for (const [key, value] of Object.entries(attributes)) made.setAttribute(key, value);
  return made;
}

function byId(id) {
  return document.getElementById(id);
}

/** Shows what a sample is beside the pointer; -1 hides it. */
function showTip(i, event) {
  const tip = byId('tip');
  tip.hidden = i < 0;
  if (i < 0) return;
  fill(tip, i);
  const [wide, high] = [tip.offsetWidth, tip.offsetHeight];
  tip.style.left = `${Math.max(4, Math.min(event.clientX + 14, innerWidth - wide - 8))}px`;
  tip.style.top = `${Math.max(4, Math.min(event.clientY + 14, innerHeight - high - 8))}px`;
}

/** Puts the sentences of a sample into an element. */
function fill(box, i) {
  const [head, text, ...rest] = sentences(i);
  box.replaceChildren(element('b', head), element('br'), element('code', text), element('br'), rest.join('; '));
}

/** Fits the pixels of a canvas to its size on the screen; returns its size in CSS pixels and the pixels to one of them. */
function fitCanvas(canvas) {
  const scale = window.devicePixelRatio || 1;
  const [width, height] = [Math.max(canvas.clientWidth, 1), Math.max(canvas.clientHeight, 1)];
  const [w, h] = [Math.round(width * scale), Math.round(height * scale)];
  if (canvas.width !== w || canvas.height !== h) Object.assign(canvas, { width: w, height: h });
  return { width, height, scale };
}

let asked = new Set();
/** Draws before the next picture, once however often it was asked for. */
function soon(draw) {
  if (!asked.size) {
    requestAnimationFrame(() => {
      const all = asked;
      asked = new Set();
      all.forEach((one) => one());
    });
  }
  asked.add(draw);
}
