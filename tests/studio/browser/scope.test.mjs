// The oscilloscope against a real run and its log.
import assert from 'node:assert/strict';
import { execFileSync } from 'node:child_process';
import { mkdtempSync, readdirSync, readFileSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { after, before, describe, test } from 'node:test';
import { beginRun, kTandem, lackingRun } from './runs.mjs';
import { leave, openBrowser, openPage, shot } from './support.mjs';

const why = lackingRun();
const kScratch = mkdtempSync(join(tmpdir(), 'tandem-studio-'));

/** Time stands until it is asked for cycles: however slow this machine is, no step is missed. */
const kOptions = ['--rate', '4', '--start-paused'];

/** A CSV file: times, and columns of numbers by name. */
function readColumns(text) {
  const [head, ...lines] = text.trim().split(/\r?\n/);
  const rows = lines.map((line) => line.split(',').map(Number));
  const names = head.split(',');
  return (name) => {
    assert.ok(names.includes(name), `no column '${name}' in '${head}'`);
    return rows.map((row) => row[names.indexOf(name)]);
  };
}

/** Figures of a step by the plainest means: the first and the last rows that are somewhere. */
function plainFigures(times, values) {
  const from = values[0];
  const last = values.slice(-Math.round(values.length / 10));
  const to = last.reduce((sum, one) => sum + one, 0) / last.length;
  const part = values.map((one) => (one - from) / (to - from));
  const first = (share) => times[part.findIndex((one) => one >= share)];
  const since = (band) => times[part.findLastIndex((one) => Math.abs(one - 1) > band)] - times[0];
  const largest = Math.max(...part);
  return {
    change: to - from,
    rise_s: first(0.9) - first(0.1),
    overshoot: largest - 1,
    peak_s: times[part.indexOf(largest)] - times[0],
    settling5_s: since(0.05),
    settling2_s: since(0.02),
  };
}

describe('the oscilloscope', { skip: why || false, timeout: 480000 }, () => {
  let browser;
  let run;
  before(async () => {
    [browser, run] = await Promise.all([
      openBrowser(),
      beginRun(kScratch, 'double_pendulum/steps.toml', [...kOptions, '--log', 'log']),
    ]);
  });
  after(async () => {
    await run?.end();
    await browser?.close();
    rmSync(kScratch, { recursive: true, force: true });
  });

  test('triggers on steps; its record and its figures are those of the log', async () => {
    const page = await openPage(browser, run.address);
    const advance = (cycles) => run.ask({ do: 'clock.step', cycles });
    advance(1800);
    await page.waitForSelector('body[data-phase="running"][data-cycle="1799"]');
    await page.click('#tab-scope');
    await page.selectOption('[aria-label="joint to tune"]', 'joint1');
    await page.selectOption('[aria-label="length of a record"]', '2');
    await page.click('button:text-is("Arm")');
    await page.waitForSelector('.scope[data-state="waiting"]');
    advance(4400);
    await page.waitForSelector('.scope[data-state="waiting"][data-captures="2"]');
    await page.click('.scope button:text-is("Stop")');
    await page.waitForSelector('.scope[data-state="stopped"]');
    assert.match(await page.textContent('.scope-state'), /^Stopped\. Arm waits until command/);
    const table = await page.$$eval('.step-table tbody tr:not(.summary)', (rows) =>
      rows.map((row) => [...row.cells].map((cell) => Number(cell.dataset.value))),
    );
    const [download] = await Promise.all([
      page.waitForEvent('download'),
      page.click('text=Save CSV'),
    ]);
    const saved = readColumns(readFileSync(await download.path(), 'utf8'));
    const trigger = Number(await page.getAttribute('.scope', 'data-trigger'));

    // While time stands a record is forced; the next cycles have a step again.
    await page.click('button:text-is("Clear")');
    await page.click('button:text-is("Force")');
    await page.waitForSelector('.scope[data-captures="1"]');
    // With another gain a mean of its own.
    run.ask({ do: 'joint.gains', joint: 'joint1', loop: 'position', kd: 0.5 });
    await page.selectOption('[aria-label="mode"]', 'single');
    await page.click('button:text-is("Arm")');
    advance(4000);
    await page.waitForSelector('.scope[data-state="filled"][data-captures="2"]');
    await page.waitForSelector('.step-group:has-text("joint1: gains of its position loop")');
    assert.deepEqual(
      await page.$$eval('.step-table tbody', (groups) =>
        groups.map((one) => one.querySelectorAll('tr:not(.step-group):not(.summary)').length),
      ),
      [1, 1],
    );
    assert.doesNotMatch(await page.textContent('.step-table'), /something was set/);
    await shot(page, 'studio-scope');
    await leave(page);
    await run.end();

    const log = join(kScratch, 'log', readdirSync(join(kScratch, 'log'))[0]);
    const logged = (topic) =>
      readColumns(
        execFileSync(kTandem, ['log', 'csv', log, '--topic', topic, '--fields', 'position_rad'], {
          encoding: 'utf8',
          maxBuffer: 2 ** 28,
        }),
      );
    const [state, command] = [logged('state'), logged('command')];
    const times = state('time_s');
    const position = state('position_rad.joint1');
    const reference = command('position_rad.joint1');
    const at = (time) => times.findIndex((one) => Math.abs(one - time) < 1e-6);

    // Every cycle of the record, to the last bit of what the studio keeps.
    const time = saved('time [s]');
    assert.equal(time.length, 2000);
    const begin = at(time[0]);
    for (const [name, values] of [
      ['state.position_rad.joint1 [rad]', position],
      ['command.position_rad.joint1 [rad]', reference],
    ]) {
      const expected = values.slice(begin, begin + 2000).map(Math.fround);
      assert.deepEqual(saved(name).map(Math.fround), expected, name);
    }

    // The trigger is the first cycle in which the reference is another one.
    const step = at(trigger);
    assert.notEqual(reference[step], reference[step - 1]);
    assert.equal(reference[step - 1], reference[step - 100]);
    const end = begin + 2000;
    const plain = plainFigures(times.slice(step, end), position.slice(step, end));
    const [, change, rise_s, overshoot, peak_s, settling5_s, settling2_s, error] = table[0];
    const kRow_s = 0.001;
    for (const [name, value, by] of [
      ['change', change, 3e-4],
      ['rise_s', rise_s, 2 * kRow_s],
      ['overshoot', overshoot, 0.005],
      ['peak_s', peak_s, 1.5 * kRow_s],
      ['settling5_s', settling5_s, 3 * kRow_s],
      ['settling2_s', settling2_s, 8 * kRow_s],
    ]) {
      assert.ok(
        Math.abs(value - plain[name]) <= by,
        `${name}: ${value}, in the log ${plain[name]}`,
      );
    }
    const final = position.slice(end - 180, end).reduce((sum, one) => sum + one, 0) / 180;
    assert.ok(Math.abs(error - (reference[end - 1] - final)) < 1e-6, `${error}`);
    assert.ok(Math.abs(Math.abs(change) - 0.1) < 0.002 && overshoot > 0.3, 'a step of steps.toml');
  });
});
