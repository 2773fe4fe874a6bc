// A browser for the tests of the studio's page, and what every test of it looks at.
import assert from 'node:assert/strict';
import { execFileSync } from 'node:child_process';
import { existsSync, mkdtempSync, readFileSync, rmSync } from 'node:fs';
import { createRequire } from 'node:module';
import { tmpdir } from 'node:os';
import { dirname, join } from 'node:path';
import { after, afterEach, before } from 'node:test';
import { fileURLToPath, pathToFileURL } from 'node:url';

const here = dirname(fileURLToPath(import.meta.url));
export const kPage = join(here, '../../../studio/page');
const require = createRequire(join(kPage, 'package.json'));

const kBrowsers = [
  process.env.TANDEM_CHROMIUM,
  '/usr/bin/chromium-headless-shell',
  '/usr/bin/chromium',
].filter(Boolean);

/** Why the tests cannot run here; empty: they can. */
export function lacking() {
  if (!existsSync(join(kPage, 'node_modules/playwright-core'))) {
    return 'npm packages of studio/page are not installed: scripts/install-node-modules';
  }
  if (!kBrowsers.some(existsSync)) return 'no chromium: apt install chromium-headless-shell';
  return '';
}

function launchOptions() {
  // WebGL by software; lines of plots on the processor, which is faster there.
  const args = [
    '--use-angle=swiftshader',
    '--enable-unsafe-swiftshader',
    '--disable-accelerated-2d-canvas',
    '--disable-gpu-rasterization',
    '--no-sandbox', // for which not every machine allows what it takes; the page is our own
  ];
  return { executablePath: kBrowsers.find(existsSync), args };
}

export async function openBrowser() {
  return require('playwright-core').chromium.launch(launchOptions());
}

/** A browser that can be killed, as by a power cut: kill(). */
export async function openMortalBrowser() {
  const { chromium } = require('playwright-core');
  const server = await chromium.launchServer(launchOptions());
  const browser = await chromium.connect(server.wsEndpoint());
  return { browser, kill: () => server.kill() };
}

/** Twenty frames a second: drawing sixty takes most of a core without a GPU, and no test counts them. */
function fewerFrames() {
  window.requestAnimationFrame = (call) => setTimeout(() => call(performance.now()), 50);
  window.cancelAnimationFrame = clearTimeout;
}

/** A page that keeps what the console and the network complained about. */
export async function openPage(browser, address, options = {}) {
  const context = await browser.newContext({
    viewport: { width: options.width ?? 1400, height: options.height ?? 860 },
    colorScheme: options.scheme ?? 'light',
    acceptDownloads: true,
    hasTouch: options.touch ?? false,
  });
  if (options.fewerFrames) await context.addInitScript(fewerFrames);
  if (options.init) await context.addInitScript(options.init);
  const page = await context.newPage();
  page.setDefaultTimeout(15000);
  page.complaints = [];
  page.outside = [];
  page.on('console', (message) => {
    const text = message.text();
    // Chromium's word about software rendering, not about the page.
    if (/GPU stall due to ReadPixels|WebGL: CONTEXT_LOST/.test(text)) return;
    if (['error', 'warning'].includes(message.type())) page.complaints.push(text);
  });
  page.on('pageerror', (error) => page.complaints.push(String(error)));
  page.on('request', (request) => {
    const { host, protocol } = new URL(request.url());
    if (/^(https?|wss?):$/.test(protocol) && host !== new URL(address).host)
      page.outside.push(request.url());
  });
  await page.goto(address);
  await page.waitForSelector(options.waitFor ?? 'body[data-cycle]');
  return page;
}

/** How many colours a picture has, in base64. */
export async function colours(page, png) {
  return page.evaluate(async (data) => {
    const image = new Image();
    image.src = `data:image/png;base64,${data}`;
    await image.decode();
    const canvas = document.createElement('canvas');
    canvas.width = image.width;
    canvas.height = image.height;
    const context = canvas.getContext('2d');
    context.drawImage(image, 0, 0);
    const pixels = context.getImageData(0, 0, image.width, image.height).data;
    const found = new Set();
    for (let i = 0; i < pixels.length; i += 4)
      found.add((pixels[i] << 16) | (pixels[i + 1] << 8) | pixels[i + 2]);
    return found.size;
  }, png);
}

/** Ends a visit: nothing was complained about, nothing left the machine. */
export async function leave(page) {
  assert.deepEqual(page.complaints, []);
  assert.deepEqual(page.outside, []);
  await page.context().close();
}

/** A picture into the folder that TANDEM_SCREENSHOTS names. */
export async function shot(page, name) {
  const folder = process.env.TANDEM_SCREENSHOTS;
  if (folder) await page.screenshot({ path: join(folder, `${name}.png`) });
}

/** Waits until something is so. */
export async function eventually(what, is) {
  for (let i = 0; i < 150; ++i) {
    if (await is()) return;
    await new Promise((resolve) => setTimeout(resolve, 100));
  }
  assert.fail(what);
}

/**
 * What axe-core finds, in words.
 * @param rules which of its rules; by default all that it has on
 * @param part of the page, a selector
 */
export async function violations(page, rules, part) {
  // As text: the page's policy forbids foreign scripts.
  if (await page.evaluate(() => !window.axe))
    await page.evaluate(readFileSync(require.resolve('axe-core/axe.min.js'), 'utf8'));
  const options = { resultTypes: ['violations'] };
  if (rules) options.runOnly = { type: 'rule', values: rules };
  return page.evaluate(
    async ([where, how]) => {
      const found = await window.axe.run(where ?? document, how);
      return found.violations.map(
        (one) =>
          `${one.id}: ${one.nodes.map((node) => `${node.target} ${node.failureSummary}`).join(' | ')}`,
      );
    },
    [part, options],
  );
}

/**
 * For the tests of a file: the page as it is built now, and robots that are played for it.
 * @returns play: a played robot, visit: its page, asked: what it was asked for by name, until: the
 * page shows a text, scratch: a folder that goes at the end
 */
export function usePlayedRobots() {
  const scratch = mkdtempSync(join(tmpdir(), 'tandem-studio-'));
  const mocks = [];
  let browser;
  let startMock;
  before(async () => {
    execFileSync(process.execPath, [join(kPage, 'build.mjs'), '--out', scratch]);
    ({ startMock } = await import(pathToFileURL(join(kPage, 'test/mock/server.mjs'))));
    browser = await openBrowser();
  });
  after(async () => {
    await browser?.close();
    rmSync(scratch, { recursive: true, force: true });
  });
  afterEach(async () => {
    for (const mock of mocks.splice(0)) await mock.stop();
  });
  return {
    scratch,
    play: async (options = {}) => {
      const mock = await startMock({ robot: 'coman', dist: scratch, ...options });
      mocks.push(mock);
      return mock;
    },
    visit: (address, options) => openPage(browser, address, { fewerFrames: true, ...options }),
    asked: (mock, name) => mock.robot.requests.filter((one) => one.do === name),
    until: (page, text) =>
      page.waitForFunction((words) => document.body.textContent.includes(words), text),
  };
}
