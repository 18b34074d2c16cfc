// Opens a page that Feedwright wrote in headless Chromium, uses it as a person does, and says as JSON what was seen.
// node page.mjs PAGE.html [--shots FOLDER]; CHROMIUM names the browser. playwright-core is looked for beside this file.
import { chromium } from 'playwright-core';
import { pathToFileURL } from 'node:url';
import { resolve, join } from 'node:path';

const [page_path, ...rest] = process.argv.slice(2);
const shots = rest[0] === '--shots' ? rest[1] : null;
const noise = [];
const seen = {};
// Software rendering: WebGL2 without a graphics card.
const args = ['--no-sandbox', '--use-angle=swiftshader', '--enable-unsafe-swiftshader', '--ignore-gpu-blocklist'];
const browser = await chromium.launch({ executablePath: process.env.CHROMIUM ?? '/usr/bin/chromium', args });

/** A page on a screen of this size that reports everything the browser complains about, and every request that leaves the file. */
async function open(width, height, colorScheme = 'light') {
  const page = await browser.newPage({ viewport: { width, height }, colorScheme });
  page.setDefaultTimeout(120000);
  page.on('console', (message) => ['error', 'warning'].includes(message.type()) && noise.push(message.text()));
  page.on('pageerror', (error) => noise.push(String(error)));
  page.on('request', (request) => request.url().startsWith('file:') || noise.push(`asks for ${request.url()}`));
  page.on('dialog', async (dialog) => { noise.push(`dialog ${dialog.message()}`); await dialog.dismiss(); });
  await page.goto(pathToFileURL(resolve(page_path)).href);
  await page.waitForSelector('html[data-drawn]', { state: 'attached' });
  await settle(page);
  return page;
}

async function settle(page) {
  await page.evaluate(() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done))));
}

async function shot(page, name, options = {}) {
  if (shots) await page.screenshot({ path: join(shots, `${name}.png`), ...options });
}

/** Different colours among the pixels of a canvas. */
async function colours(page, id) {
  return page.evaluate((name) => {
    const canvas = document.getElementById(name);
    const copy = document.createElement('canvas');
    Object.assign(copy, { width: canvas.width, height: canvas.height });
    const pen = copy.getContext('2d');
    pen.drawImage(canvas, 0, 0);
    const pixels = new Uint32Array(pen.getImageData(0, 0, copy.width, copy.height).data.buffer);
    return new Set(pixels).size;
  }, id);
}

const picture = (page, id) => page.evaluate((name) => document.getElementById(name).toDataURL(), id);

/** Moves over a canvas until the tip shows; returns its text and place. */
async function hover(page, id) {
  const box = await page.locator(`#${id}`).boundingBox();
  for (let k = 1; k < 40; k++) {
    for (let m = 1; m < 20; m++) {
      const [x, y] = [box.x + (box.width * k) / 40, box.y + (box.height * m) / 20];
      await page.mouse.move(x, y);
      const tip = page.locator('#tip');
      if (await tip.isVisible()) return { x, y, text: await tip.innerText() };
    }
  }
  return { text: '' };
}

const page = await open(1280, 900);
seen.checks = await page.locator('#checks li').count();
seen.verdict = await page.locator('.verdict').innerText();
await shot(page, 'first');
seen.above = await colours(page, 'above');
await page.locator('#above').scrollIntoViewIfNeeded();
const on_path = await hover(page, 'above');
seen.hover_above = on_path.text;
if (on_path.text) await page.mouse.click(on_path.x, on_path.y);
await settle(page);
seen.clicked = await page.locator('#listing .row.here').count();
seen.clicked_line = Number(await page.locator('#listing .row.here').first().getAttribute('data-line'));
seen.here = await page.locator('#here').innerText();
await page.locator('#curves-canvas').scrollIntoViewIfNeeded();
seen.curves = await colours(page, 'curves-canvas');
seen.hover_curves = (await hover(page, 'curves-canvas')).text;
await page.mouse.move(0, 0);
await shot(page, 'curves');

// From the listing back to the views.
const other = page.locator('#listing .row').filter({ hasText: /[XYZ]/ }).last();
const before_click = await picture(page, 'curves-canvas');
await other.click();
await settle(page);
seen.listing_moves_the_cursor = (await picture(page, 'curves-canvas')) !== before_click;
seen.changed_rows = await page.locator('#listing .row.changed').count();
await page.locator('#listing').scrollIntoViewIfNeeded();
await shot(page, 'listing');

// In space: drawn, turns, plays.
await page.click('#show-space');
await settle(page);
seen.space = await colours(page, 'space');
const still = await picture(page, 'space');
const box = await page.locator('#space').boundingBox();
await page.mouse.move(box.x + 200, box.y + 100);
await page.mouse.down();
await page.mouse.move(box.x + 330, box.y + 130, { steps: 4 });
await page.mouse.up();
await settle(page);
seen.turns = (await picture(page, 'space')) !== still;
await shot(page, 'space');
await page.click('#play');
await page.waitForTimeout(1200);
// Not by the mouse: a busy computer may be slow to draw while it plays.
await page.evaluate(() => document.getElementById('play').click());
await settle(page);
seen.played_to = Number(await page.locator('#until').inputValue());
for (const key of await page.locator('#quantity option').evaluateAll((all) => all.map((one) => one.value))) {
  await page.selectOption('#quantity', key);
  await settle(page);
}
await page.selectOption('#axis', 'time');
await settle(page);

/** How far the page is wider than the screen, px, and what sticks out first. */
const too_wide = (one) => one.evaluate(() => document.documentElement.scrollWidth - document.documentElement.clientWidth);
const narrow = await open(400, 800);
seen.too_wide_at_400 = await too_wide(narrow);
await shot(narrow, 'narrow', { fullPage: true });
const dark = await open(1280, 900, 'dark');
seen.dark_above = await colours(dark, 'above');
await shot(dark, 'dark', { fullPage: true });
await page.emulateMedia({ media: 'print' });
if (shots) await page.pdf({ path: join(shots, 'print.pdf'), format: 'A4' });

// Without WebGL2 the top view stands alone and a sentence says why.
const poor = await browser.newPage();
poor.setDefaultTimeout(120000);
await poor.addInitScript(() => {
  const get = HTMLCanvasElement.prototype.getContext;
  HTMLCanvasElement.prototype.getContext = function (kind, ...more) {
    return kind === 'webgl2' ? null : get.call(this, kind, ...more);
  };
});
await poor.goto(pathToFileURL(resolve(page_path)).href);
await poor.waitForSelector('html[data-drawn]', { state: 'attached' });
seen.without_webgl = await poor.locator('#no-space').isVisible();
seen.above_without_webgl = await colours(poor, 'above');

seen.noise = noise;
await browser.close();
console.log(JSON.stringify(seen, null, 1));
