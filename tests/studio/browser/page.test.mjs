// The page against a robot that is played: node --test tests/studio/browser/page.test.mjs
import assert from 'node:assert/strict';
import { readFileSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { describe, test } from 'node:test';
import { kPhone, looks } from './looks.mjs';
import { colours, eventually, lacking, leave, shot, usePlayedRobots } from './support.mjs';

const why = lacking();

/** What each tab has once it is filled. */
const kFilled = {
  plots: '.pane .uplot',
  scope: '.scope[data-state]',
  joints: '[data-joint][data-controller]',
  controllers: '.parameter-table:not(.shadow-table)',
  inputs: '.slider-row',
  loop: '.loop-histogram svg',
  expected: '#panel-expected td',
  events: '.event-table td',
};
const tabsOf = (page) =>
  page.$$eval('[role="tab"]:not([hidden])', (tabs) => tabs.map((tab) => tab.id.slice(4)));
const openTab = async (page, tab) => {
  await page.click(`#tab-${tab}`);
  await page.waitForSelector(kFilled[tab]);
};

describe('the studio page', { skip: why || false, timeout: 480000 }, () => {
  const { play, visit, asked, until, scratch: kScratch } = usePlayedRobots();

  test('shows the run, and a robot that is not blank', async () => {
    const mock = await play();
    const page = await visit(mock.address);
    await page.waitForSelector('body[data-state="live"][data-phase="running"]');
    await page.waitForSelector('.scene[data-drawn]');
    await page.waitForFunction(() => Number(document.querySelector('.scene').dataset.drawn) > 0);
    assert.match(await page.textContent('header'), /coman.*squat\.toml.*running.*live/s);
    const png = (await page.locator('.canvas').screenshot()).toString('base64');
    const found = await colours(page, png);
    assert.ok(found > 12, `${found} colours`);
    await leave(page);
  });

  test('pauses, draws the joints where the run has them, steps, sets the rate; the commands are shown', async () => {
    const mock = await play();
    const page = await visit(mock.address);
    await page.waitForSelector('.clock-body:not([disabled])');
    await page.locator('.clock-body button:text-is("Pause")').click();
    await page.waitForSelector('body[data-paused="true"]');
    await until(page, 'tandem clock pause');
    const j = mock.robot.joints.findIndex((joint) => joint.name === 'LKneeSag');
    const expected = mock.robot.position(j, mock.robot.time);
    await page.waitForFunction(
      (value) =>
        Math.abs(
          Number(document.querySelector('.scene').getAttribute('data-joint-LKneeSag')) - value,
        ) < 1e-6,
      Math.fround(expected),
    );
    const before = mock.robot.cycle;
    await page.fill('.clock-body input', '25');
    await page.locator('.clock-body button:text-is("Step")').click();
    await page.waitForFunction(
      (cycle) => Number(document.body.dataset.cycle) === cycle,
      before + 25,
    );
    await page.selectOption('.clock-body select', '0.5');
    await page.locator('.clock-body button:text-is("Set rate")').click();
    await until(page, 'tandem clock rate 0.5');
    assert.deepEqual(
      asked(mock, 'clock.rate').map((one) => one.rate),
      [0.5],
    );
    await leave(page);
  });

  test('finds a signal by words, draws it with its statistics, and stands while the robot goes on', async () => {
    const mock = await play();
    const page = await visit(mock.address);
    await page.waitForSelector('.pane .uplot');
    await page.fill('.search', 'lknee torque');
    await page.press('.search', 'Enter');
    await page.press('.search', 'Escape');
    assert.match(await page.textContent('.pane >> nth=0'), /state\.torque_Nm\.LKneeSag/);
    await page.click('.live');
    await page.waitForSelector('.live[aria-pressed="true"]');
    const stands = await page.getAttribute('.plots', 'data-to');
    const cycle = Number(await page.getAttribute('body', 'data-cycle'));
    await page.waitForFunction((from) => Number(document.body.dataset.cycle) > from + 300, cycle);
    assert.equal(await page.getAttribute('.plots', 'data-to'), stands);
    assert.equal(mock.robot.paused, false);
    await page.waitForSelector('.pane[data-rows]');
    await page.click('.live');
    await page.waitForFunction(
      (from) => Number(document.querySelector('.plots').dataset.to) > Number(from),
      stands,
    );
    await page.click('text=statistics');
    await page.locator('button[aria-label^="d/dt of"]').first().click();
    await page.locator('select[aria-label^="difference of"]').first().selectOption({ index: 1 });
    const legend = await page.textContent('.pane >> nth=0');
    assert.match(legend, /min.*max.*mean.*rms.*std/s);
    assert.match(legend, /d\/dt state\.position_rad/);
    assert.match(legend, /state\.position_rad\.\w+ − command\.position_rad/);
    await leave(page);
  });

  test('a dragged span shows every cycle of it; one selected time is everywhere', async () => {
    const mock = await play();
    const page = await visit(mock.address);
    await page.locator('.pane .u-over').first().hover(); // which waits until it stands
    const box = await page.locator('.pane .u-over').first().boundingBox();
    await page.mouse.move(box.x + 100, box.y + 40);
    await page.mouse.down();
    await page.mouse.move(box.x + 220, box.y + 40, { steps: 4 });
    await page.mouse.up();
    await page.waitForSelector('.pane[data-cycles-per-row="1"]');
    const plots = await page.evaluate(() => ({ ...document.querySelector('.plots').dataset }));
    assert.ok(Number(plots.to) - Number(plots.from) < 3, JSON.stringify(plots));
    await page.mouse.click(box.x + 150, box.y + 40);
    await page.waitForSelector('.scene-when:not([hidden])');
    assert.match(await page.textContent('.scene-when'), /at the selected time/);
    const { selected } = await page.evaluate(() => ({
      ...document.querySelector('.plots').dataset,
    }));
    const j = mock.robot.joints.findIndex((joint) => joint.name === 'LKneeSag');
    const expected = mock.robot.position(j, Number(selected));
    await page.waitForFunction(
      (value) =>
        Math.abs(
          Number(document.querySelector('.scene').getAttribute('data-joint-LKneeSag')) - value,
        ) < 0.01,
      expected,
    );
    await page.click('text=Back to now');
    await page.waitForSelector('.scene-when[hidden]', { state: 'attached' });
    await leave(page);
  });

  test('time of a bus cannot be paused, nor a run of another version be led: the page says so', async () => {
    const mock = await play({ bus: true, protocol: 2 });
    const page = await visit(mock.address);
    await until(page, 'Time is advanced by the bus');
    assert.equal(await page.locator('.clock-body button:text-is("Pause")').isDisabled(), true);
    await until(page, 'The run speaks version 2 of the studio, this page 1');
    await leave(page);
  });

  test('stops without token or control; then faults can be reset', async () => {
    const mock = await play();
    const looking = await visit(mock.look);
    await until(looking, 'Looking only');
    await looking.click('.estop');
    await looking.waitForSelector('body[data-phase="faulted"]');
    await until(looking, 'emergency stop');
    assert.equal(mock.robot.latched, 1);
    await shot(looking, 'studio-fault');
    await leave(looking);
    const page = await visit(mock.address);
    await page.click('button:text-is("Reset faults")');
    await page.waitForSelector('body[data-phase="held"]');
    await page.click('button:text-is("Start controllers")');
    await page.waitForSelector('body[data-phase="running"]');
    await leave(page);
  });

  test('parameters are set and taken back; inputs are sliders', async () => {
    const mock = await play();
    const page = await visit(mock.address);
    await page.click('#tab-controllers');
    const field = page.locator('input[aria-label="kp of squat"]');
    await field.fill('55');
    await page.click('button[aria-label="set kp of squat"]');
    await until(page, 'tandem controller set squat kp=55');
    await page.click('button[aria-label="undo kp of squat"]');
    await page.waitForFunction(
      () => document.querySelector('[aria-label="kp of squat"]').value === '40',
    );
    assert.deepEqual(
      asked(mock, 'controller.set').map((one) => one.parameters.kp),
      [55, 40],
    );
    await field.fill('101');
    await page.click('button[aria-label="set kp of squat"]');
    await until(page, 'it is from 0 to 100 Nm/rad');
    await page.click('#tab-inputs');
    const slider = page.locator('input[aria-label="x [m/s]"]');
    await slider.focus();
    await page.keyboard.press('End');
    await until(page, 'tandem input squat/rate x=1');
    assert.equal(mock.robot.input, 1);
    await leave(page);
  });

  test('a shadow shows how far it is, and is switched to when within', async () => {
    const mock = await play();
    const page = await visit(mock.address);
    await page.click('#tab-controllers');
    await page.click('button[aria-label="shadow rest"]');
    const table = page.locator('[aria-label="difference of rest from what is commanded"]');
    await page.waitForSelector('.shadow:visible tbody tr');
    const knee = mock.robot.joints[1].name;
    assert.equal(await table.locator('tbody tr').count(), 5, 'what never differed is left out');
    const row = table.locator(`tr:has-text("${knee}")`).first();
    assert.deepEqual(await row.locator('th, td').allTextContents(), [
      knee,
      'squat',
      'position',
      '0.0200',
      '0.3500',
      '0.0035',
      'rad',
    ]);
    await page.fill('[aria-label="bound of rest\'s difference"]', '0.005');
    await page.click('button[aria-label="switch when within, to rest"]');
    await until(page, 'switch --stop squat --start rest --when-within=0.005 --timeout=10');
    await until(page, `The switch waits: 0.0200 rad at ${knee}`);
    await page.click('button[aria-label="end shadow rest"]');
    await page.waitForSelector('.shadow', { state: 'hidden' });
    await leave(page);
  });

  test('takes control, moves a joint to its goal, and jogs only while held', async () => {
    const mock = await play();
    mock.robot.active = false;
    const page = await visit(mock.address);
    await page.click('#tab-joints');
    const row = page.locator('[data-joint="LElbj"]');
    await row.locator('.opener').click();
    assert.equal(await row.locator('button:text-is("Go")').isDisabled(), true);
    await page.click('.lease');
    await page.waitForSelector('body[data-control="yours"]');
    await row.locator('input[aria-label^="goal of LElbj"]').first().fill('-30deg');
    await row.locator('button:text-is("Go")').click();
    await page.waitForFunction(
      () =>
        Math.abs(
          Number(document.querySelector('.scene').getAttribute('data-joint-LElbj')) + 0.523599,
        ) < 1e-5,
    );
    await until(page, 'tandem joint move LElbj --to=-0.523599');
    await row.locator('button:text-is("hold ▶")').hover();
    await page.mouse.down();
    const goals = asked(mock, 'joint.move').length;
    await eventually('goals while it is held', () => asked(mock, 'joint.move').length >= goals + 2);
    await page.mouse.up();
    await eventually('a stop at the release', () => asked(mock, 'joint.stop').length >= 1);
    const moves = asked(mock, 'joint.move').length;
    await page.waitForTimeout(600);
    assert.equal(asked(mock, 'joint.move').length, moves, 'no goal after the release');
    await shot(page, 'studio-joints');
    await leave(page);
    await eventually('a halt when the page is gone', () => asked(mock, 'joint.halt').length >= 1);
  });

  test('a lost connection is said, looks stale, and comes back', async () => {
    const mock = await play();
    const page = await visit(mock.address);
    mock.drop();
    await page.waitForSelector('body.stale[data-state="lost"]');
    assert.match(await page.textContent('.link'), /lost \d+\.\d s ago/);
    await page.waitForSelector('body[data-state="live"]:not(.stale)');
    mock.say({ op: 'ended', how: 'as planned', log: '/tmp/run.mcap' });
    await until(page, 'ended: as planned; its log: /tmp/run.mcap');
    await leave(page);
  });

  test('without a connection the stop says what to type', async () => {
    const mock = await play();
    const page = await visit(mock.address);
    await mock.stop();
    await page.waitForSelector('body[data-state="lost"]');
    await page.click('.estop');
    await until(
      page,
      'The stop is not confirmed: there is no connection to the run. Type: tandem estop',
    );
    page.complaints = page.complaints.filter((text) => !text.includes('ERR_CONNECTION_REFUSED'));
    await leave(page);
  });

  test('names and texts of any kind are texts', async () => {
    const mock = await play({ hostile: true });
    const page = await visit(mock.address);
    for (const tab of (await tabsOf(page)).reverse()) await openTab(page, tab);
    await page.fill('.search', 'img src');
    await page.click('.estop');
    await page.waitForSelector('body[data-phase="faulted"]');
    assert.equal(await page.evaluate(() => window.hacked), undefined);
    assert.equal(await page.locator('img').count(), 0);
    assert.match(await page.textContent('header'), /<img src=x onerror/);
    await page.waitForFunction(() => Number(document.querySelector('.scene').dataset.drawn) > 0);
    await leave(page);
  });

  test('a layout is kept, saved and opened', async () => {
    const mock = await play();
    const page = await visit(mock.address);
    await page.waitForSelector('.pane .uplot');
    await page.selectOption('select[aria-label="preset layout"]', 'legs torque');
    await page.waitForSelector('.plots[data-panes="2"]');
    await page.reload();
    await page.waitForSelector('.plots[data-panes="2"]');
    const [download] = await Promise.all([
      page.waitForEvent('download'),
      page.click('text=Save layout'),
    ]);
    const layout = JSON.parse(readFileSync(await download.path(), 'utf8'));
    assert.equal(layout.panes.length, 2);
    layout.panes.push({ series: [{ kind: 'signal', name: 'state.nothing' }] });
    const file = join(kScratch, 'layout.json');
    writeFileSync(file, JSON.stringify(layout));
    await page.setInputFiles('input[type=file]', file);
    await page.waitForSelector('.plots[data-panes="3"]');
    await until(page, 'state.nothing (not in this run)');
    writeFileSync(file, 'no');
    await page.setInputFiles('input[type=file]', file);
    await until(page, 'layout.json: the file is no JSON');
    await leave(page);
  });

  test('a closed loop moves its joints without motors', async () => {
    const mock = await play({ robot: 'four_bar', passive: ['coupler', 'rocker'] });
    const page = await visit(mock.address);
    await page.waitForFunction(
      () =>
        Math.abs(Number(document.querySelector('.scene').getAttribute('data-joint-rocker'))) > 0.01,
    );
    await shot(page, 'studio-four-bar');
    await leave(page);
  });

  test('without WebGL there are words, and all else works', async () => {
    const mock = await play();
    const init = () => {
      const get = HTMLCanvasElement.prototype.getContext;
      HTMLCanvasElement.prototype.getContext = function context(kind, ...rest) {
        return kind.startsWith('webgl') ? null : get.call(this, kind, ...rest);
      };
    };
    const page = await visit(mock.address, { init });
    await until(page, 'This browser has no WebGL');
    await page.waitForSelector('.pane .uplot');
    await page.waitForFunction(() =>
      document.querySelector('.scene').hasAttribute('data-joint-LKneeSag'),
    );
    await leave(page); // without a word in the console
  });

  test('on a phone, in the light and in the dark: nothing for axe-core to find, nothing too wide', async () => {
    const mock = await play();
    const page = await visit(mock.address, kPhone);
    const beyond = await page.$$eval('[role="tab"]', (tabs) =>
      tabs.filter((tab) => tab.getBoundingClientRect().right > innerWidth).map((tab) => tab.id),
    );
    assert.deepEqual(beyond, [], 'tabs that are not seen');
    const begins = await page.$eval('#panel-plots', (panel) => panel.getBoundingClientRect().top);
    assert.ok(begins < 600, `what a tab has begins at ${begins} of 844 pixels`);
    await page.focus('[role="tab"][aria-selected="true"]');
    await page.keyboard.press('End');
    assert.equal(await page.getAttribute('#tab-events', 'aria-selected'), 'true');
    await page.keyboard.press('Home');
    const tabs = await tabsOf(page);
    assert.deepEqual(tabs, Object.keys(kFilled));
    await openTab(page, 'scope');
    await page.selectOption('[aria-label="joint to tune"]', 'LKneeSag');
    await page.click('button:text-is("Force")');
    await page.waitForSelector('.scope[data-captures="1"]');
    await openTab(page, 'joints');
    await page.locator('.opener').first().click();
    await page.locator('.tuning summary').first().click();
    await openTab(page, 'controllers');
    await page.click('button[aria-label="shadow rest"]');
    await page.waitForSelector('.shadow:visible tbody tr');
    await openTab(page, 'loop');
    await page.waitForSelector('.loop-histogram svg[aria-label*="late: 61462 cycles"]');
    assert.match(await page.textContent('.buses'), /load 31\.2 %.*foot \(40\)31/s);
    await looks(page, ['phone'], tabs, (tab) => openTab(page, tab));
    mock.robot.paused = true; // which the page shows, too, and which leaves nothing to draw
    await page.waitForSelector('body[data-paused="true"]');
    await looks(page, ['light', 'dark'], tabs, (tab) => openTab(page, tab));
    await leave(page);
  });

  test('an emulation shows its robot, says where control is, and offers none', async () => {
    const mock = await play({ emulated: 'ethercat' });
    const page = await visit(mock.address, kPhone);
    await page.waitForSelector('.emulation-panel:not([hidden])');
    await until(
      page,
      'control is on the other side of the wire, tandem run … --hal ethercat --studio',
    );
    await until(page, 'A master sends SYNC. All axes are enabled.');
    await page.waitForFunction(() => Number(document.querySelector('.scene').dataset.drawn) > 0);
    const knee = () => page.getAttribute('.scene', 'data-joint-LKneeSag');
    const before = await knee();
    assert.ok(Number.isFinite(Number(before)), before);
    await eventually('the robot moves', async () => (await knee()) !== before);
    assert.deepEqual(await tabsOf(page), ['plots', 'scope', 'joints', 'events']);
    const open = (tab) => page.click(`#tab-${tab}`);
    for (const tab of ['plots', 'scope', 'joints', 'events']) {
      await open(tab);
      for (const name of ['.estop', '.lease', '.opener', '.clock-body', '.group-bar', '.site-jog'])
        assert.equal(await page.locator(name).filter({ visible: true }).count(), 0, name);
    }
    await until(page, 'injected link_down');
    const row = page.locator('[data-joint="LKneeSag"]');
    await open('joints');
    await row.locator('.mode:text-is("position")').waitFor();
    assert.match(await row.textContent(), /-?\d\.\d{3} rad.* A.* °C/s);
    await looks(page, ['phone', 'light', 'dark'], ['joints'], open, 'emulation');
    assert.deepEqual(mock.robot.requests, [], 'there is nobody to ask');
    await leave(page);
  });
});
