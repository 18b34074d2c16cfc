// The data of the page, and what can be shown of it. A *sample* is a stretch of the path on which everything is constant:
// `p0[i]` to `p1[i]` are its points, `s[i]`, `before_s[i]`, `after_s[i]` the length along the feed moves and the times at its end.
const DATA = JSON.parse(document.getElementById('data').textContent);
const SAMPLES = DATA.samples;
const COUNT = SAMPLES.line.length;

/** Values of a quantity at the samples, as programmed or as written. */
function columnOf(key, side) {
  if (key === 'feed') return SAMPLES[side === 'before' ? 'feed_before' : 'feed_after'];
  if (key === 'change') return feedChange();
  const load = DATA.loads.find((one) => one.key === key);
  return load ? load[side] : [];
}

let changes = null;
/** Change of the commanded feed at every sample, percent. */
function feedChange() {
  changes ??= SAMPLES.feed_after.map((after, i) => {
    const before = SAMPLES.feed_before[i];
    return before > 0 ? 100 * (after / before - 1) : 0;
  });
  return changes;
}

/** Everything that can be shown: key, label, unit. */
function quantities() {
  const own = DATA.rewritten ? [{ key: 'change', label: 'change of feed', unit: '%' }] : [];
  return [...own, { key: 'feed', label: 'feed', unit: DATA.unit_feed }, ...DATA.loads];
}

function quantity(key) {
  return quantities().find((one) => one.key === key);
}

/** The limit of a load at every sample, `null` where none holds; `steps` are [first sample, value]. */
function limitColumn(key) {
  const load = DATA.loads.find((one) => one.key === key);
  if (!load || !load.limit.length) return null;
  const column = new Array(COUNT).fill(null);
  load.limit.forEach(([from, value], k) => {
    const to = k + 1 < load.limit.length ? load.limit[k + 1][0] : COUNT;
    if (value !== null) column.fill(value, from, to);
  });
  return column;
}

/** The largest of some numbers, nothing below `least`. */
function largest(values, least = 0) {
  let most = least;
  for (const value of values) if (value > most) most = value;
  return most;
}

const scales = new Map();
/** How a quantity becomes a colour: the ramp, and the values at its ends. A fiftieth of the samples may lie beyond the upper one: a few
 *  fast moves in the air would take the colours from the cuts. */
function colourScale(key) {
  if (!scales.has(key)) {
    const values = columnOf(key, 'after').filter((_, i) => !SAMPLES.rapid[i]).map(Math.abs).sort((a, b) => a - b);
    const usual = values[Math.floor(0.98 * (values.length - 1))] ?? 0;
    const far = usual > 0 ? usual : Math.max(values.at(-1) ?? 0, 1e-9);
    const two_sided = key === 'change';
    const high = two_sided ? Math.max(far, 1) : far;
    scales.set(key, { ramp: two_sided ? TWO_SIDED : RISING, low: two_sided ? -high : 0, high, more: (values.at(-1) ?? 0) > high });
  }
  return scales.get(key);
}

/** The least round number not below a value: axes end there. */
function roundUp(value) {
  const power = 10 ** Math.floor(Math.log10(Math.max(value, 1e-12)));
  return [1, 1.2, 1.6, 2, 2.4, 3, 4, 5, 6, 8, 10].find((step) => step * power >= value * 0.999999) * power;
}

const TEXT = new Map();
for (const [line, old] of DATA.listing) TEXT.set(line, old);

/** A number as people read it. */
function short(value) {
  if (value === null || value === undefined || !Number.isFinite(value)) return '';
  if (Math.abs(value) >= 100) return String(Math.round(value));
  return String(Number(value.toPrecision(3)));
}

/** Seconds as people read them. */
function clock(seconds) {
  if (seconds < 60) return `${seconds.toFixed(1)} s`;
  const whole = Math.round(seconds);
  const rest = String(whole % 60).padStart(2, '0');
  const minutes = Math.floor(whole / 60) % 60;
  if (whole < 3600) return `${minutes}:${rest} min`;
  return `${Math.floor(whole / 3600)}:${String(minutes).padStart(2, '0')}:${rest} h`;
}

/** What is to be said of a sample: lines of plain text; the second is the line of the program. */
function sentences(i) {
  const line = SAMPLES.line[i];
  const words = [`Line ${line}, ${DATA.operations[SAMPLES.operation[i]].name}`, TEXT.get(line) ?? ''];
  if (SAMPLES.rapid[i]) return [...words, 'rapid'];
  const [was, is] = [SAMPLES.feed_before[i], SAMPLES.feed_after[i]];
  const feed = DATA.rewritten && was !== is ? `${short(was)} → ${short(is)}` : short(is);
  words.push(`feed ${feed} ${DATA.unit_feed}`);
  const shown = quantity(state.quantity);
  const load = shown.key === 'feed' || shown.key === 'change' ? DATA.loads[0] : shown;
  if (load) {
    const limit = limitColumn(load.key)?.[i];
    const of = limit ? ` of ${short(limit)}` : '';
    words.push(`${load.label} ${short(load.after[i])}${of} ${load.unit}`);
  }
  const why = DATA.reasons[SAMPLES.reason[i]];
  if (why) words.push(why);
  return words;
}

/** The sample nearest to a line of the program; -1 where there is none. */
function sampleOfLine(line) {
  let best = -1;
  for (let i = 0; i < COUNT; i++) {
    if (SAMPLES.line[i] === line) return i;
    if (SAMPLES.line[i] <= line && (best < 0 || SAMPLES.line[i] > SAMPLES.line[best])) best = i;
  }
  return best;
}
