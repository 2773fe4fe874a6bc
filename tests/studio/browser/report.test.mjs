// A report as it is opened from the disk: TANDEM=… node --test tests/studio/browser/report.test.mjs
import assert from 'node:assert/strict';
import { execFileSync, spawn } from 'node:child_process';
import { mkdtempSync, rmSync, statSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { after, before, describe, test } from 'node:test';
import { pathToFileURL } from 'node:url';
import { kTandem, lackingRun } from './runs.mjs';
import { colours, kPage, leave, openBrowser, openPage, shot, violations } from './support.mjs';

const why = lackingRun();
const kScratch = mkdtempSync(join(tmpdir(), 'tandem-report-'));
const kMostBytes = 5_000_000;

describe('a report opened from the disk', { skip: why || false, timeout: 480000 }, () => {
  let browser;
  let address;
  const log = join(kScratch, 'a/coman-squat-001.mcap');
  const tandem = (...words) =>
    execFileSync(kTandem, words, { cwd: kScratch, encoding: 'utf8', maxBuffer: 1 << 27 });

  before(async () => {
    const squat = join(kPage, '../../config/coman/squat.toml');
    tandem('run', squat, '--duration', '0.8', '--quiet', '--log', 'a', '--report');
    address = pathToFileURL(join(kScratch, 'a/coman-squat-001/report.html')).href;
    browser = await openBrowser();
  });
  after(async () => {
    await browser?.close();
    rmSync(kScratch, { recursive: true, force: true });
  });

  /** Goes to a time by the slider, as a hand does. */
  const seek = (page, time) =>
    page.locator('.seek').evaluate((slider, value) => {
      slider.value = String(value);
      slider.dispatchEvent(new Event('input'));
    }, time);
  const joint = async (page, name) =>
    Number(await page.locator('.scene').getAttribute(`data-joint-${name}`));
  const at = (page, time) =>
    page.waitForFunction(
      (value) => Math.abs(Number(document.body.dataset.time) - value) < 1e-6,
      time,
    );

  test('shows the robot where the log has it, and moves it', async () => {
    assert.ok(statSync(join(kScratch, 'a/coman-squat-001/report.html')).size < kMostBytes);
    const page = await openPage(browser, address);
    const [head, ...lines] = tandem('log', 'csv', log, '--fields', 'position_rad')
      .trim()
      .split('\n');
    const column = head.split(',').indexOf('position_rad.LKneeSag');
    const knee = lines.map((line) => Number(line.split(',')[column]));
    const range = Math.max(...knee) - Math.min(...knee);
    const cycles = [1300, 700, 250];
    const seen = [];
    for (const cycle of cycles) {
      const time = Number(lines[cycle].split(',')[0]);
      await seek(page, time);
      await at(page, time);
      await page.waitForFunction(
        ([value, step]) =>
          Math.abs(
            Number(document.querySelector('.scene').getAttribute('data-joint-LKneeSag')) - value,
          ) <= step,
        [knee[cycle], range / 65534],
      );
      seen.push((await page.locator('.canvas').screenshot()).toString('base64'));
    }
    assert.notEqual(seen[0], seen[2], 'the robot has moved');
    assert.ok((await colours(page, seen[0])) > 12);
    await page.click('.play');
    await page.waitForFunction(() => Number(document.body.dataset.time) > 0.3);
    await page.click('.play');
    assert.ok(Number.isFinite(await joint(page, 'LKneeSag')));
    await leave(page);
  });

  test('has the facts, plots of every signal, one time for all, and is on paper', async () => {
    const page = await openPage(browser, address);
    await page.waitForSelector('.report .pane .uplot');
    assert.match(await page.textContent('.report'), /backend.*sim.*Tracking.*LKneeSag/s);
    assert.deepEqual(await violations(page), []);
    await shot(page, 'studio-report');
    await page.click('#tab-plots');
    await page.fill('.search', 'lknee torque');
    await page.press('.search', 'Enter');
    await page.press('.search', 'Escape');
    assert.match(await page.textContent('.pane.active'), /state\.torque_nm\.LKneeSag/);
    const first = await page.getAttribute('body', 'data-time');
    await page.locator('.pane.active .u-over').click({ position: { x: 100, y: 40 } });
    await page.waitForFunction(
      (before) =>
        document.body.dataset.time !== before &&
        document.querySelector('.plots').dataset.selected === document.body.dataset.time,
      first,
    );
    await page.locator('[aria-label="zoom in"]').click();
    await page.waitForFunction(() => Number(document.querySelector('.plots').dataset.from) > 0);
    await page.click('#tab-events');
    assert.match(await page.textContent('.event-table'), /started/);
    await page.emulateMedia({ media: 'print' });
    await page.evaluate(() => dispatchEvent(new Event('beforeprint')));
    assert.ok(await page.locator('.report h1').isVisible());
    assert.ok(!(await page.locator('.side').isVisible()));
    await leave(page);
  });

  test('fits a phone, in the dark, and asks nobody', async () => {
    const page = await openPage(browser, address, { width: 390, height: 800, scheme: 'dark' });
    await page.waitForSelector('.report .pane .uplot');
    assert.equal(await page.evaluate(() => document.documentElement.scrollWidth), 390);
    assert.equal(await page.locator('.estop').count(), 0);
    assert.deepEqual(await violations(page), []);
    await page.click('#tab-joints');
    assert.ok(!(await page.locator('.opener').first().isVisible()));
    await shot(page, 'studio-report-phone');
    await leave(page);
  });

  test('prints in light colours, its plots as wide as a sheet, with what says which line is whose', async () => {
    const page = await openPage(browser, address, { scheme: 'dark' });
    await page.waitForSelector('.report .pane .uplot');
    const look = () =>
      page.evaluate(() => ({
        dark: document.documentElement.hasAttribute('data-dark'),
        widths: [...document.querySelectorAll('.report canvas')].map((one) => one.clientWidth),
        shown: [...document.querySelectorAll('.report .legend thead')].some((one) =>
          one.checkVisibility(),
        ),
      }));
    const before = await look();
    assert.ok(before.dark && before.shown);
    assert.ok(Math.max(...before.widths) > 690, 'wider than a sheet on the screen');
    await page.evaluate(() => dispatchEvent(new Event('beforeprint')));
    const paper = await look();
    assert.ok(!paper.dark && !paper.shown, 'values at a selected time are none of paper');
    assert.ok(Math.max(...paper.widths) <= 690);
    await page.evaluate(() => dispatchEvent(new Event('afterprint')));
    assert.deepEqual(await look(), before);
    await leave(page);
  });

  test('says what a browser lacks, and shows the rest', async () => {
    const page = await openPage(browser, address, {
      init: () => {
        delete window.DecompressionStream;
        HTMLCanvasElement.prototype.getContext = () => null;
      },
      waitFor: '.said',
    });
    await page.waitForFunction(() => /cannot unpack/.test(document.body.textContent));
    assert.match(await page.textContent('.scene-words'), /no WebGL/);
    assert.ok(await page.locator('.report h1').isVisible());
    await page.context().close();
  });

  test('served by `tandem studio LOG`, it has every cycle, and a ghost; a signal ends it', async () => {
    const served = spawn(kTandem, ['studio', log, log, '--port', '0'], { cwd: kScratch });
    const ended = new Promise((resolve) => served.on('exit', resolve));
    let said = '';
    for await (const data of served.stdout) {
      said += data;
      if (/studio: http\S+\n/.test(said)) break;
    }
    const page = await openPage(browser, /http\S+/.exec(said)[0]);
    await page.waitForSelector('.report .pane .uplot');
    await page.waitForSelector('.scene-legend[data-shown="1"] li:has-text("B")');
    await page.locator('.scene .toggle:text-is("B") input').uncheck();
    await page.waitForSelector('.scene-legend[data-shown="0"]', { state: 'attached' });
    await page.click('#tab-plots');
    await page.waitForSelector('.plots .pane[data-cycles-per-row]');
    for (let i = 0; i < 3; ++i) await page.locator('[aria-label="zoom in"]').click();
    await page.waitForSelector('.plots .pane[data-cycles-per-row="1"]');
    assert.match(await page.textContent('.plots .pane'), /B\/state\.position_rad/);
    // In the head both logs; in the figures the second one's line is dashed, as in the plots.
    await page.click('#tab-report');
    assert.match(await page.locator('.report .logs').first().textContent(), /A\s*B.*started/s);
    assert.equal((await page.locator('.report .legend [data-log="B/"]').count()) > 0, true);
    assert.match(await page.locator('.report .legend').first().textContent(), /measured, B/);
    await leave(page);
    served.kill('SIGINT');
    assert.equal(await ended, 0);
  });
});
