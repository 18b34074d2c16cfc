// Colours for values from 0 to 1. Both ramps hold for every kind of colour vision: they go from dark to light (or through a light
// middle) and from blue to yellow or orange, never from red to green. The tables are our own, even steps of lightness.
const RISING = [[18, 36, 92], [36, 62, 120], [66, 88, 128], [98, 112, 130], [130, 136, 128], [165, 160, 116], [202, 186, 94], [236, 214, 66], [252, 240, 110]];
const TWO_SIDED = [[20, 66, 140], [52, 106, 178], [104, 150, 202], [160, 188, 214], [188, 190, 190], [222, 186, 140], [218, 146, 68], [192, 102, 20], [140, 62, 4]];

/** The colour of a value from 0 to 1 on a ramp, as three numbers from 0 to 255. */
function rampColour(ramp, value) {
  const at = Math.min(Math.max(value, 0), 1) * (ramp.length - 1);
  const low = Math.min(Math.floor(at), ramp.length - 2);
  return ramp[low].map((part, k) => Math.round(part + (ramp[low + 1][k] - part) * (at - low)));
}

function cssColour([r, g, b]) {
  return `rgb(${r},${g},${b})`;
}

/** A ramp as a CSS gradient, for the legend. */
function gradient(ramp) {
  return `linear-gradient(90deg,${ramp.map(cssColour).join(',')})`;
}

/** The value of a CSS variable of the page: colours follow light, dark and print. */
function themeColour(name) {
  return getComputedStyle(document.documentElement).getPropertyValue(name).trim();
}
