// The page against real runs: TANDEM=build/release/bin/tandem node --test tests/studio/browser/run.test.mjs
import assert from 'node:assert/strict';
import { execFileSync } from 'node:child_process';
import { cpSync, mkdtempSync, readFileSync, rmSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { after, afterEach, before, describe, test } from 'node:test';
import { beginRun, kConfig, kTandem, lackingRun } from './runs.mjs';
import { eventually, leave, openBrowser, openMortalBrowser, openPage, shot } from './support.mjs';

const why = lackingRun();
const kScratch = mkdtempSync(join(tmpdir(), 'tandem-studio-'));

describe('the studio of a run', { skip: why || false, timeout: 480000 }, () => {
  const runs = [];
  let browser;
  before(async () => {
    browser = await openBrowser();
  });
  afterEach(async () => {
    for (const run of runs.splice(0)) await run.end();
  });
  after(async () => {
    await browser?.close();
    rmSync(kScratch, { recursive: true, force: true });
  });

  const begin = async (experiment, ...options) => {
    const run = await beginRun(kScratch, experiment, ['--rate', '1', '--no-log', ...options]);
    runs.push(run);
    return run;
  };
  const visit = (address, options) => openPage(browser, address, options);
  const joint = (run, name) =>
    run.ask({ do: 'joint.list' }).joints.find((one) => one.joint === name);

  test('COMAN squats, stands still, steps; the page has the joints of the run', async () => {
    const run = await begin('coman/squat.toml');
    const page = await visit(run.address);
    await page.waitForSelector('body[data-phase="running"]');
    await page.waitForSelector('.clock-body:not([disabled])');
    await page.locator('.clock-body button:text-is("Pause")').click();
    await page.waitForSelector('body[data-paused="true"]');
    const before = run.ask({ do: 'clock.show' }).cycles;
    await page.fill('.clock-body input', '40');
    await page.locator('.clock-body button:text-is("Step")').click();
    await eventually('40 cycles later', () => run.ask({ do: 'clock.show' }).cycles === before + 40);
    await page.waitForFunction(
      (cycle) => Number(document.body.dataset.cycle) >= cycle,
      before + 39,
    );
    for (const name of ['LKneeSag', 'RShLat', 'WaistYaw']) {
      const expected = Math.fround(joint(run, name).position_rad);
      await page.waitForFunction(
        ([key, value]) =>
          Math.abs(
            Number(document.querySelector('.scene').getAttribute(`data-joint-${key}`)) - value,
          ) < 1e-6,
        [name, expected],
      );
    }
    await page.locator('.clock-body button:text-is("Resume")').click();
    await page.waitForSelector('body[data-paused="false"]');
    await page.waitForSelector('.pane .uplot');
    await shot(page, 'studio-squat');
    await leave(page);
  });

  test('a joint of Panda goes where the page says; when the browser is killed it holds', async () => {
    const run = await begin('panda/hold.toml');
    const mortal = await openMortalBrowser();
    const page = await openPage(mortal.browser, run.address);
    await page.waitForSelector('body[data-phase="running"]');
    await page.click('#tab-joints');
    const row = page.locator('[data-joint="panda_joint4"]');
    await row.locator('.opener').click();
    await row.locator('button:text-is("Stop its controller")').click();
    await page.click('dialog .go');
    await page.waitForSelector('[data-joint="panda_joint4"][data-controller=""]');
    await page.click('.lease');
    await page.waitForSelector('body[data-control="yours"]');
    await row.locator('input[aria-label^="speed of"]').fill('1');
    await row.locator('input[aria-label^="goal of panda_joint4"]').first().fill('-1.5');
    await row.locator('button:text-is("Go")').click();
    await eventually(
      'it is at its goal',
      () => Math.abs(joint(run, 'panda_joint4').position_rad + 1.5) < 0.02,
    );
    await shot(page, 'studio-panda');
    await row.locator('input[aria-label^="speed of"]').fill('0.1');
    await row.locator('input[aria-label^="goal of panda_joint4"]').first().fill('-2.5');
    await row.locator('button:text-is("Go")').click();
    await eventually('it moves', () => joint(run, 'panda_joint4').moving);
    assert.deepEqual(page.complaints, []);
    await mortal.kill();
    await eventually('it holds', () => !joint(run, 'panda_joint4').moving);
    const place = joint(run, 'panda_joint4').position_rad;
    assert.ok(place > -2.4, `at ${place} rad, far from the goal`);
  });

  test('Panda: a posture, gains that are taken back and saved, a hand that is led', async () => {
    const run = await begin('panda/hold.toml');
    const page = await visit(run.address);
    await page.waitForSelector('body[data-phase="running"]');
    run.ask({ do: 'controller.stop', name: 'hold' });
    run.ask({ do: 'joint.move', joint: 'panda_joint4', target_rad: -2, speed_rad_s: 2 });
    await page.click('#tab-joints');
    await page.click('.lease');
    await page.waitForSelector('body[data-control="yours"]');
    const kp = () => joint(run, 'panda_joint4').gains.position.kp;
    const row = page.locator('[data-joint="panda_joint4"]');
    await row.locator('.opener').click();
    await row.locator('.tuning summary').click();
    const gain = row.locator('input[aria-label^="kp of the position loop"]');
    for (const value of ['3500', '3000']) {
      await gain.fill(value);
      await gain.press('Enter');
      await eventually(`kp is ${value}`, () => kp() === Number(value));
    }
    await row.locator('button[aria-label^="undo kp of the position loop"]').click();
    await eventually('it is taken back', () => kp() === 3500);
    const [saved] = await Promise.all([
      page.waitForEvent('download'),
      page.click('text=Save gains as TOML'),
    ]);
    await shot(page, 'studio-gains');

    // The robot of the saved gains: its robot.toml with these tables in place of its own.
    const folder = join(kScratch, 'tuned');
    cpSync(join(kConfig, 'panda'), folder, { recursive: true });
    const file = join(folder, 'robot.toml');
    const rest = readFileSync(file, 'utf8')
      .replace(/\[gains\.\w+\]\n(?:.+\n)+/g, '')
      .replace('names = ["panda_joint4"]\n', '$&gains = "large_panda_joint4"\n');
    writeFileSync(file, `${rest}\n${readFileSync(await saved.path(), 'utf8')}`);
    execFileSync(kTandem, ['check', file], { stdio: 'ignore' });
    assert.match(rest, /gains = "large_panda_joint4"/);

    await page.fill('input[aria-label^="speed of the posture"]', '100');
    await page.click('button:text-is("Go to posture")');
    await page.click('dialog .go');
    const ready = () => Math.abs(joint(run, 'panda_joint4').position_rad + 2.356) < 0.01;
    await eventually('it is in its posture', ready);
    await eventually('it stands', () => !joint(run, 'panda_joint4').moving);
    await page.locator('button:text-is("+z")').hover();
    await page.mouse.down();
    await eventually('it is led', () => joint(run, 'panda_joint4').moving);
    await page.waitForTimeout(300);
    await page.mouse.up();
    await eventually('it brakes', () => !joint(run, 'panda_joint4').moving);
    assert.ok(Math.abs(joint(run, 'panda_joint4').position_rad + 2.356) < 0.2, 'a small way');
    await leave(page);
  });

  test('the emergency stop needs nothing; a reset and a start go on', async () => {
    const run = await begin('panda/hold.toml');
    const looking = await visit(run.address.replace(/#.*/, ''));
    await looking.waitForSelector('body[data-phase="running"]');
    await looking.click('.estop');
    await looking.waitForSelector('body[data-phase="faulted"]');
    assert.equal(run.ask({ do: 'status' }).phase, 'faulted');
    await leave(looking);
    const page = await visit(run.address);
    await page.locator('button:text-is("Reset faults")').click();
    await page.waitForSelector('body[data-phase="held"]');
    await page.locator('button:text-is("Start controllers")').click();
    await page.waitForSelector('body[data-phase="running"]');
    await run.end();
    await page.waitForSelector('body[data-state="ended"].ended-well');
    await leave(page);
    const other = await begin('double_pendulum/hold.toml', '--on-fault', 'end');
    const last = await visit(other.address);
    await last.waitForSelector('body[data-phase="running"]');
    await last.click('.estop');
    await last.waitForSelector('body[data-state="ended"]:not(.ended-well)');
    assert.match(await last.textContent('.link'), /^ended: by a fault/);
    await leave(last);
  });

  test('a simulated run goes back, and on; the page has the past, then the new branch', async () => {
    const run = await begin('double_pendulum/hold.toml');
    const page = await visit(run.address);
    await page.waitForSelector('body[data-phase="running"]');
    await page.waitForSelector('.clock-body:not([disabled])');
    const seen = (name) => page.evaluate((key) => Number(document.body.dataset[key]), name);
    const press = (label) => page.locator(`.clock-body button:text-is("${label}")`).click();
    await page.waitForFunction(() => Number(document.body.dataset.time) > 1.4);
    await press('Pause');
    await page.waitForSelector('body[data-paused="true"]');
    await press('Step');
    await page.waitForTimeout(100);
    const before = run.ask({ do: 'clock.show' }).time_s;
    await press('Back 1 s');
    await page.waitForFunction(
      (time) => Math.abs(Number(document.body.dataset.time) - time) < 1e-6,
      before - 1,
    );
    assert.ok(Math.abs(run.ask({ do: 'clock.show' }).time_s - (before - 1)) < 1e-6);
    for (const name of ['joint1', 'joint2']) {
      const place = Math.fround(joint(run, name).position_rad);
      await page.waitForFunction(
        ([key, value]) =>
          Math.abs(
            Number(document.querySelector('.scene').getAttribute(`data-joint-${key}`)) - value,
          ) < 1e-6,
        [name, place],
      );
    }
    await page.waitForFunction(
      (time) => Number(document.querySelector('.plots').dataset.to) <= Math.max(10, time),
      before - 0.9,
    );
    await page.fill('.condition', 'torqe(joint1) > 1Nm');
    await press('Back until');
    await page.waitForSelector('.past .field-error:not([hidden])');
    await shot(page, 'studio-back');
    await page.click('#tab-events');
    await page.waitForFunction(() => document.body.textContent.includes('time went back to'));
    await press('Resume');
    const there = await seen('time');
    await page.waitForFunction((time) => Number(document.body.dataset.time) > time + 0.1, there);
    assert.ok((await seen('time')) < before, 'it goes on from there, not from where it was');
    await leave(page);
  });

  test('a page of another version says so', async () => {
    const run = await begin('double_pendulum/hold.toml');
    const files = ['index.html', 'studio.js', 'studio.css'];
    const texts = await Promise.all(
      ['', ...files.slice(1)].map(async (file) =>
        (await fetch(new URL(`/${file}`, run.address))).text(),
      ),
    );
    const changed = async (from, to) => {
      const folder = mkdtempSync(join(kScratch, 'page-'));
      const own = [...texts];
      own[1] = texts[1].replaceAll(from, to);
      assert.notEqual(own[1], texts[1]);
      for (const [i, file] of files.entries()) writeFileSync(join(folder, file), own[i]);
      const other = await begin('double_pendulum/hold.toml', '--studio-page', folder);
      return visit(other.address, { waitFor: 'body[data-state]' });
    };
    const says = (page, words) =>
      page.waitForFunction((text) => document.body.textContent.includes(text), words);
    const version = execFileSync(kTandem, ['--version'], { encoding: 'utf8' }).trim().split(' ')[1];
    const older = await changed(`"${version}"`, '"0.0.9"');
    await says(older, `The run is of Tandem ${version}, this page of 0.0.9.`);
    await leave(older);
    const newer = await changed('tandem.studio.v1', 'tandem.studio.v2');
    await says(newer, 'The run does not speak tandem.studio.v2');
    await newer.context().close();
  });
});
