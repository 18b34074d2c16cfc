// Uses the served page as a person does: drops a program, looks at it, changes a limit, saves what was written. Says as JSON what was
// seen. node serve.mjs ADDRESS PROGRAM [--shots FOLDER]; CHROMIUM names the browser.
import { chromium } from 'playwright-core';
import { readFileSync } from 'node:fs';
import { basename, join } from 'node:path';

const [address, program, ...rest] = process.argv.slice(2);
const shots = rest[0] === '--shots' ? rest[1] : null;
const noise = [];
const seen = {};
const args = ['--no-sandbox', '--use-angle=swiftshader', '--enable-unsafe-swiftshader', '--ignore-gpu-blocklist'];
const browser = await chromium.launch({ executablePath: process.env.CHROMIUM ?? '/usr/bin/chromium', args });
const page = await browser.newPage({ viewport: { width: 1280, height: 900 } });
page.setDefaultTimeout(120000);
// The page that says why there are no feeds is answered as such, which the browser notes.
const refusal = 'Failed to load resource: the server responded with a status of 422 (Refused)';
page.on('console', (message) => ['error', 'warning'].includes(message.type()) && message.text() !== refusal && noise.push(message.text()));
page.on('pageerror', (error) => noise.push(String(error)));
page.on('request', (request) => request.url().startsWith(address) || noise.push(`asks for ${request.url()}`));

const drawn = () => page.waitForSelector('html[data-drawn]', { state: 'attached' });
/** What the page says of the feeds. */
async function feeds() {
  return {
    verdict: await page.locator('.verdict').innerText(),
    changed: await page.locator('#listing .row.changed').allInnerTexts(),
    took: await page.locator('#took').innerText(),
  };
}

await page.goto(address);
seen.programs = await page.locator('.programs a').allInnerTexts();

// Dropped as from a file manager.
const file = await page.evaluateHandle(([name, text]) => {
  const carried = new DataTransfer();
  carried.items.add(new File([text], name));
  return carried;
}, [basename(program), readFileSync(program, 'latin1')]);
await page.dispatchEvent('#drop', 'drop', { dataTransfer: file });
await page.waitForURL(/\/program\//);
seen.dropped = decodeURIComponent(page.url().slice(address.length));
await page.goto(address);
seen.programs_then = await page.locator('.programs a').allInnerTexts();

await page.locator('.programs a').last().click();
await page.selectOption('select[name=setup]', { index: 1 });
await page.click('form.limits button');
await drawn();
seen.first = await feeds();
if (shots) await page.screenshot({ path: join(shots, 'served.png') });

// Another limit: from the click to the page drawn anew.
await page.fill('input[name=force_xy]', '110');
const before = Date.now();
await page.click('form.limits button');
await page.waitForURL(/force_xy=110/);
await drawn();
seen.ms = Date.now() - before;
seen.then = await feeds();
seen.marked = await page.locator('label.changed input').evaluateAll((all) => all.map((one) => `${one.name}=${one.value}`));
const [download] = await Promise.all([page.waitForEvent('download'), page.getByText('save the program').click()]);
seen.saved_as = download.suggestedFilename();
seen.saved = readFileSync(await download.path(), 'latin1');
await page.goBack();

seen.noise = noise;
await browser.close();
console.log(JSON.stringify(seen, null, 1));
