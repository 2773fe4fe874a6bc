// What the page shows is so, and says why: node --test tests/studio/browser/clear.test.mjs
import assert from 'node:assert/strict';
import { describe, test } from 'node:test';
import { kPhone } from './looks.mjs';
import { colours, eventually, lacking, leave, usePlayedRobots } from './support.mjs';

const why = lacking();

describe('the studio page is clear', { skip: why || false, timeout: 480000 }, () => {
  const { play, visit, asked, until } = usePlayedRobots();

  test('a joint that a controller leads cannot be moved, and says why', async () => {
    const mock = await play();
    const page = await visit(mock.address);
    await page.click('#tab-joints');
    const row = page.locator('[data-joint="LElbj"]');
    await row.locator('.opener').click();
    await until(page, 'Claimed by squat: it cannot be moved from here. Take control first.');
    await page.click('.lease');
    await page.waitForSelector('body[data-control="yours"]');
    await row.locator('.who:text-is("Claimed by squat: it cannot be moved from here.")').waitFor();
    const goal = row.locator('input[type="text"][aria-label^="goal of LElbj"]');
    for (const part of ['button:text-is("Go")', 'input.goal', 'button:text-is("hold ▶")'])
      assert.equal(await row.locator(part).isDisabled(), true, part);
    assert.equal(await goal.isDisabled(), true);
    assert.equal(await row.locator('button:text-is("Reset drive")').isDisabled(), false);
    // Nor can a hand that hangs on it.
    const lead = page.locator('.site-jog button:text-is("+z")');
    assert.equal(await lead.isDisabled(), true);
    await until(page, 'l_hand cannot be led from here.');
    assert.match(await page.textContent('.site-jog'), /Claimed by squat: LElbj, .*WaistLat\./);
    await row.locator('button:text-is("Stop its controller")').click();
    await page.click('dialog .go');
    await row.locator('.who:text-is("Free, standing")').waitFor();
    assert.equal(await lead.isDisabled(), false);
    assert.equal(await row.locator('button:text-is("Go")').isDisabled(), false);
    assert.equal(asked(mock, 'joint.move').length, 0);
    await leave(page);
  });

  test('the condition that time goes on until is shown, and given up', async () => {
    const mock = await play();
    const page = await visit(mock.address);
    await page.waitForSelector('.past .condition:not([disabled])');
    for (const condition of ['time() > 90 s', 'time() > 99 s']) {
      await page.fill('.past .condition', condition);
      await page.click('button:text-is("Go on until")');
      await until(page, `Goes on until ${condition}`);
    }
    await until(page, 'it waits: it replaces one that waited: time() > 90 s');
    await page.fill('.past .condition', 'true');
    await page.click('button:text-is("Go on until")');
    await until(page, 'it waits: it holds now, so it has to end first');
    await page.click('.past-waits button:text-is("Cancel")');
    await page.waitForSelector('.past-waits', { state: 'hidden' });
    assert.deepEqual(asked(mock, 'clock.until').at(-1), { do: 'clock.until', cancel: true });
    await leave(page);
  });

  test('buttons keep their places when a time is selected', async () => {
    const mock = await play();
    const page = await visit(mock.address);
    await page.waitForSelector('.pane .uplot');
    await page.locator('button:text-is("Pause picture")').click();
    const save = page.locator('button:text-is("Save layout")');
    const before = await save.boundingBox();
    const back = page.locator('button:text-is("Back to now")');
    assert.equal(await back.isDisabled(), true);
    const box = await page.locator('.u-over').first().boundingBox();
    await page.mouse.click(box.x + 100, box.y + 40);
    await page.waitForSelector('button:text-is("Back to now"):not([disabled])');
    assert.deepEqual(await save.boundingBox(), before);
    // Nor do buttons lie over what is drawn.
    const over = await page.$$eval('.plots .pane', (panes) =>
      panes.filter((pane) => {
        const head = pane.querySelector('.pane-head').getBoundingClientRect();
        return head.bottom > pane.querySelector('.plot-box').getBoundingClientRect().top;
      }),
    );
    assert.equal(over.length, 0);
    await leave(page);
  });

  test('when the run is over nothing looks as if it could be asked', async () => {
    const mock = await play();
    mock.robot.active = true;
    const page = await visit(mock.address);
    await page.click('#tab-inputs');
    await page.waitForSelector('.slider-row');
    await page.click('#tab-controllers');
    await page.waitForSelector('.parameter-table:not(.shadow-table)');
    await page.click('#tab-joints');
    await page.locator('.opener').first().click();
    mock.say({ op: 'ended', how: 'as planned', log: '/tmp/run.mcap' });
    await page.waitForSelector('body[data-state="ended"]');
    await until(page, 'The run has ended: nothing can be asked of it any more.');
    await eventually('what acts on a run is disabled', async () => {
      const parts =
        '.clock-body :is(button, input, select), .controllers :is(button, input, select), .inputs :is(button, input), .predict button, .lease, .opener, .panel button, .group-bar button, .site-jog button, .action .copy';
      return page.$$eval(
        parts,
        (all) => all.length > 60 && all.every((one) => one.matches(':disabled')),
      );
    });
    const left = await page.$$eval('.joints :is(button, input, select):enabled', (all) =>
      all.map((one) => one.ariaLabel),
    );
    assert.deepEqual(left, ['filter joints']);
    assert.match(await page.getAttribute('.opener', 'title'), /The run has ended/);
    // Nor what is made, or would be enabled, from then on.
    await page.evaluate(() => {
      document.querySelector('.opener').disabled = false;
      document.querySelector('.inputs').append(document.createElement('button'));
    });
    await page.waitForFunction(() =>
      [...document.querySelectorAll('.opener, .inputs button')].every((one) => one.disabled),
    );
    assert.match(await page.getAttribute('.parameter-table button', 'title'), /The run has ended/);
    assert.equal(await page.getAttribute('.estop', 'aria-disabled'), 'true');
    await page.click('.estop', { force: true });
    await until(page, 'use its own emergency stop');
    await page.click('#tab-plots');
    assert.equal(await page.locator('button:text-is("Pause picture")').isDisabled(), false);
    await leave(page);
  });

  test('what is hot, lost or large is read whole, in wide and narrow windows', async () => {
    const mock = await play();
    mock.robot.winding = 99.6;
    const page = await visit(mock.address, { width: 1440 });
    await page.click('#tab-joints');
    await until(page, '°C hot');
    for (const width of [1440, 1280, 390]) {
      await page.setViewportSize({ width, height: 900 });
      const cut = await page.$$eval('.cell:not(.name)', (all) =>
        all.filter((one) => one.scrollWidth > one.clientWidth + 1).map((one) => one.textContent),
      );
      assert.deepEqual(cut, [], `${width}`);
    }
    await leave(page);
  });

  test('on a phone the table of the loop is whole, and nobody is told to point', async () => {
    const mock = await play();
    const page = await visit(mock.address, { ...kPhone, touch: true });
    assert.doesNotMatch(await page.textContent('.said-bar'), /Point at/);
    await page.click('#tab-loop');
    await page.waitForSelector('.loop-bar');
    const beyond = await page.$$eval('.loop-table :is(th, td, .loop-bar)', (all) =>
      all
        .filter((one) => {
          const { left, right } = one.getBoundingClientRect();
          return left < 0 || right > innerWidth || one.scrollWidth > one.clientWidth + 1;
        })
        .map((one) => `${one.tagName} ${one.textContent}`),
    );
    assert.deepEqual(beyond, []);
    await leave(page);
  });

  test('the ground is drawn as the run has it: a slope, a patch', async () => {
    const mock = await play();
    mock.robot.ground = {
      height_m: 0.1,
      terrain: { x_m: [-10, 10], y_m: [-10, 10], height_m: [-2, 2, -2, 2], coarser: true },
      patches: [
        {
          name: 'ice',
          x_m: [-1, 1],
          y_m: [-20, 20],
          static_friction: 0.1,
          sliding_friction: 0.05,
          stiffness_share: 1,
        },
      ],
    };
    const page = await visit(mock.address);
    await page.waitForFunction(() => Number(document.querySelector('.scene').dataset.drawn) > 0);
    await until(page, 'ice: friction 0.1, sliding 0.05');
    await until(page, 'ground drawn coarser');
    const under = () => page.$eval('.scene', (scene) => scene.dataset.under.split(' ').map(Number));
    const [x, , height] = await under();
    assert.ok(Math.abs(height - (0.1 + 0.2 * x)) < 1e-3, `${x} ${height}`);
    const clip = await page.locator('.canvas').boundingBox();
    const png = (await page.screenshot({ clip })).toString('base64');
    assert.ok((await colours(page, png)) > 12);
    await leave(page);
  });
});
