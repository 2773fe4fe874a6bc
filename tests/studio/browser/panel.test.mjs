// Groups of joints, gains, and what the 3D view has: node --test tests/studio/browser/panel.test.mjs
import assert from 'node:assert/strict';
import { describe, test } from 'node:test';
import { eventually, lacking, leave, shot, usePlayedRobots, violations } from './support.mjs';

const why = lacking();

/** A triangle whose material has a picture of elsewhere. */
const kCollada = `<COLLADA><library_images><image id="i"><init_from>http://elsewhere.example/x.png</init_from></image></library_images>
  <library_effects><effect id="e"><profile_COMMON><newparam sid="s"><surface type="2D"><init_from>i</init_from></surface></newparam>
    <technique><phong><diffuse><texture texture="s" texcoord="UV"/></diffuse></phong></technique></profile_COMMON></effect></library_effects>
  <library_materials><material id="m"><instance_effect url="#e"/></material></library_materials>
  <library_geometries><geometry id="g"><mesh><source id="s"><float_array id="a">0 0 0 1 0 0 0 1 0</float_array>
    <technique_common><accessor source="#a" stride="3"/></technique_common></source>
    <vertices id="v"><input semantic="POSITION" source="#s"/></vertices>
    <triangles material="m"><input semantic="VERTEX" source="#v" offset="0"/><p>0 1 2</p></triangles></mesh></geometry></library_geometries>
  <library_visual_scenes><visual_scene><node><instance_geometry url="#g"><bind_material><technique_common>
    <instance_material symbol="m" target="#m"/></technique_common></bind_material></instance_geometry></node></visual_scene></library_visual_scenes></COLLADA>`;

/** STL of a ball of 2 * n * n triangles. */
function ball(n) {
  const stl = Buffer.alloc(84 + 100 * n * n);
  stl.writeUInt32LE(2 * n * n, 80);
  let at = 84;
  const corner = (i, j) => {
    const [a, b] = [(Math.PI * i) / n, (2 * Math.PI * j) / n];
    for (const x of [Math.sin(a) * Math.cos(b), Math.sin(a) * Math.sin(b), Math.cos(a)])
      at = stl.writeFloatLE(0.2 * x, at);
  };
  for (let k = 0; k < 2 * n * n; ++k) {
    const [i, j] = [(k >> 1) % n, Math.floor(k / 2 / n)];
    at += 12;
    corner(i, j);
    corner(i + 1, j + (k % 2));
    corner(i + 1 - (k % 2), j + 1);
    at += 2;
  }
  return stl;
}

/** What is red for ten seconds is for half a second. */
function soonNotRed() {
  const set = window.setTimeout;
  window.setTimeout = (call, ms, ...more) => set(call, ms === 10000 ? 500 : ms, ...more);
}

describe('the joints and the 3D view of the studio', {
  skip: why || false,
  timeout: 480000,
}, () => {
  const { play, visit, asked, until } = usePlayedRobots();

  test('several joints at once: asked before, the command shown, gains taken back', async () => {
    const mock = await play();
    mock.robot.active = false;
    mock.robot.claimed.set('LKneeSag', 'kick');
    const page = await visit(mock.address, { init: soonNotRed });
    await page.click('#tab-joints');
    await page.click('.lease');
    await page.waitForSelector('body[data-control="yours"]');
    await page.selectOption('select[aria-label="group of joints"]', { label: 'left leg' });
    await until(page, ', 1 claimed by a controller');
    await page.click('button:text-is("Idle") >> nth=0');
    await page.waitForSelector('dialog[open]');
    assert.deepEqual(await violations(page), []);
    const question = await page.textContent('dialog p');
    assert.match(question, /^These joints lose their torque, and may fall: LHipSag, [^.]*\./);
    assert.match(question, /\. Claimed by kick: LKneeSag\. These are not asked\.$/);
    assert.doesNotMatch(await page.textContent('dialog code'), /LKneeSag/);
    await shot(page, 'studio-question');
    // Behind the question nothing is left but the stop, by pointer or by keys.
    const alive = await page.$$eval(
      ':is(button, input, select, summary, a, [tabindex]):not(dialog *)',
      (all) => all.filter((one) => !one.closest('[inert]')).map((one) => one.className),
    );
    assert.deepEqual(alive, ['estop']);
    const reached = new Set();
    for (let i = 0; i < 8; ++i) {
      await page.keyboard.press('Tab');
      reached.add(
        await page.evaluate(() => {
          const { activeElement: one } = document;
          return one.closest('dialog, .estop')?.className ?? one.tagName;
        }),
      );
    }
    assert.deepEqual([...reached].sort(), ['BODY', 'confirm', 'estop']);
    await page.click('.estop');
    await eventually('a stop beside the question', () => asked(mock, 'estop').length === 1);
    await page.keyboard.press('Escape');
    await page.waitForSelector('dialog', { state: 'detached' });
    assert.equal(await page.locator('[inert]').count(), 0);
    assert.equal(asked(mock, 'joint.set').length, 0, 'nothing is asked for before the answer');
    // A page that its checks kept busy for a second has lost control, as it should.
    if ((await page.getAttribute('body', 'data-control')) !== 'yours') {
      await page.click('.lease');
      await page.waitForSelector('body[data-control="yours"]');
    }
    await page.click('button:text-is("Go to posture")');
    await page.click('dialog .go');
    await eventually('the posture', () => asked(mock, 'joint.posture').length === 1);
    const [posture] = asked(mock, 'joint.posture');
    assert.equal(posture.posture, 'home');
    assert.ok(
      posture.joints.length > 3 && posture.joints.every((name) => /^L(?!KneeSag)/.test(name)),
    );
    await until(page, 'tandem joint posture home --joints L');
    await page.fill('input[aria-label="filter joints"]', 'elb');
    await page.selectOption('select[aria-label="group of joints"]', 'shown');
    await page.click('button:text-is("Hold") >> nth=0');
    await until(page, '2 of 2 done');
    const row = page.locator('[data-joint="LElbj"]');
    await row.locator('.opener').click();
    await row.locator('.tuning summary').click();
    await row.locator('input[aria-label^="goal of LElbj"]').first().fill('99');
    await row.locator('button[aria-label="go to the goal of LElbj"]').click();
    await until(page, '99.000 rad is beyond the limits of LElbj');
    assert.equal(asked(mock, 'joint.move').length, 0);
    const gain = row.locator('input[aria-label^="kp of the position loop"]');
    const undo = row.locator('button[aria-label^="undo kp of the position loop"]');
    await gain.fill('2000');
    await gain.press('Enter');
    await until(page, 'kp = 2000 is beyond 1000 – give 0 to 1000');
    // It is dated, and red for a while: later, or after the next action, it alarms nobody.
    assert.match(await page.textContent('.said-bar'), /at \d+\.\d{3} s: .*beyond 1000/);
    await page.waitForSelector('.said-bar.bad');
    await page.waitForSelector('.said-bar:not(.bad)');
    await until(page, 'beyond 1000');
    await gain.fill('55');
    await gain.press('Enter');
    await until(page, 'tandem joint gains LElbj position --kp=55');
    await undo.click();
    await eventually('40 again', () => mock.robot.gainsOf('LElbj').position.kp === 40);
    await leave(page);
  });

  test('meshes that are there are drawn; a line says which are not', async () => {
    const corners = ['0 0 0', '0.2 0 0', '0 0.2 0'];
    const mesh = `solid a\nfacet normal 0 0 1\nouter loop\n${corners.map((at) => `vertex ${at}\n`).join('')}endloop\nendfacet\nendsolid a\n`;
    const meshes = { 'a.stl': mesh, 'b.obj': 'v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n' };
    const more = { 'd.stl': 'solid d', 'e.dae': kCollada, 'f.dae': `<!DOCTYPE x>${kCollada}` };
    const mock = await play({ meshes: { ...meshes, 'c.stl': null, ...more, 'g.stl': ball(180) } });
    const page = await visit(mock.address);
    await until(page, 'not drawn: 3 shapes');
    const words = await page.textContent('.not-drawn');
    assert.doesNotMatch(words, /e\.dae/, 'it is drawn, and its picture is not asked for');
    assert.match(words, /mesh f\.dae \(.*it defines entities\)/);
    await page.click('summary:text-is("drawn coarser: 1 mesh")');
    await until(page, 'In this browser a robot has 50,000 triangles at most.');
    const coarse = await page.textContent('.not-drawn[open]');
    const drawn = /g\.stl: (\d+) of 64800 triangles/.exec(coarse)?.[1];
    assert.ok(drawn > 25000 && drawn < 50000, coarse);
    assert.deepEqual(await violations(page), []);
    await shot(page, 'studio-coarser');
    assert.match(
      words,
      /mesh c\.stl \(it is not there\).*mesh d\.stl \(its content is neither STL, OBJ nor COLLADA\)/s,
    );
    await leave(page);
  });

  test('what controllers draw is in the scene, named, and can be switched off', async () => {
    const mock = await play();
    const page = await visit(mock.address);
    // One of the five is in a frame that the robot lacks.
    await page.waitForSelector('.scene-legend[data-shown="4"]');
    assert.match(await page.textContent('.scene-legend'), /squat: push.*squat: goal/s);
    await shot(page, 'studio-marks');
    const pixels = () => page.locator('.canvas canvas').screenshot();
    await page.locator('.clock-body button:text-is("Pause")').click();
    await page.waitForSelector('body[data-paused="true"]');
    await page.waitForTimeout(300);
    const before = await pixels();
    await page.click('label:text-is("marks")');
    await page.waitForSelector('.scene-legend', { state: 'hidden' });
    await page.waitForTimeout(300);
    assert.ok(!before.equals(await pixels()), 'the picture is another one');
    await leave(page);
  });

  test('parameters follow the run: back in time, from elsewhere, not over what is typed', async () => {
    const mock = await play();
    const page = await visit(mock.address);
    await page.click('#tab-controllers');
    const kp = page.locator('input[aria-label="kp of squat"]');
    const undo = page.locator('button[aria-label="undo kp of squat"]');
    const shows = (value) =>
      page.waitForFunction(
        (text) => document.querySelector('[aria-label="kp of squat"]').value === text,
        value,
      );
    await kp.fill('55');
    await kp.press('Enter');
    await eventually('it is set', () => mock.robot.gain === 55);
    assert.equal(await undo.isDisabled(), false);
    const to = mock.robot.time - 1;
    mock.robot.gain = 40; // as it was then
    mock.say({ op: 'back', time_s: to, cycle: Math.round(1000 * to), from_s: to + 1 });
    await shows('40');
    assert.equal(await undo.isDisabled(), true, 'nothing is left to take back');
    await kp.fill('66');
    mock.robot.gain = 20;
    await until(page, 'in force: 20');
    assert.equal(await kp.inputValue(), '66', 'what is being typed stays');
    mock.robot.paused = true;
    await kp.press('Enter');
    await until(page, 'asked for; in force: 20');
    await shot(page, 'studio-asked-for');
    assert.deepEqual(await violations(page), []);
    mock.robot.ask({ do: 'clock.resume' });
    await page.waitForSelector('.in-force', { state: 'hidden' });
    await undo.click();
    await eventually('the former value', () => mock.robot.gain === 20);
    await shows('20');
    await leave(page);
  });

  test('what is expected: names with their reasons, on a phone as well', async () => {
    const mock = await play();
    const row = (name, reason) => ({
      ...{ name, passed: reason === '', margin: null, unit: 'Nm', at_s: null, reason },
      ...{ joint: '', awaits: '', holds_so_far: false },
    });
    const begins = 'its window was never reached: it begins at 30 s, and the run ended at 20 s';
    mock.robot.expected = [
      { ...row('the knee keeps within its torque', ''), margin: 24.5, at_s: 4.352 },
      { ...row('the base stays level', 'it did not hold in 3 of 900 cycles'), margin: -0.2 },
      { ...row('it settles after the push', begins), awaits: 'it begins at 30 s' },
    ];
    const page = await visit(mock.address, { scheme: 'dark' });
    await page.click('#tab-expected');
    await until(page, '1 of 3 hold so far, 1 not yet.');
    const texts = (selector) => page.locator(`.expect-table ${selector}`).allTextContents();
    assert.deepEqual(await texts('thead th'), ['expectation', 'so far', 'margin', 'at']);
    assert.deepEqual(await texts('.doc'), [
      'it did not hold in 3 of 900 cycles',
      'it begins at 30 s',
    ]);
    assert.deepEqual(await texts('td:nth-child(2)'), ['✓ holds', '✗ does not', '… not yet']);
    const colours = await page.$$eval('.expect-table td:nth-child(2)', (cells) =>
      cells.map((cell) => getComputedStyle(cell).color),
    );
    assert.equal(new Set(colours).size, 3, 'each has its colour');
    const edges = await page.$eval('.expect-table', (table) =>
      ['thead th', 'tbody th'].map((one) => table.querySelector(one).getBoundingClientRect().x),
    );
    assert.equal(edges[0], edges[1], 'a head above its column');
    await shot(page, 'studio-dark-expected');
    await page.setViewportSize({ width: 390, height: 844 });
    const cut = await page.$eval(
      '.expected .table-box',
      (box) => box.scrollWidth - box.clientWidth,
    );
    assert.equal(cut, 0, 'pixels that are not seen');
    await page.locator('.expect-table').scrollIntoViewIfNeeded();
    assert.deepEqual(await violations(page), []);
    await shot(page, 'studio-narrow-expected');
    await leave(page);
  });

  test('a search says that it goes on, for how long, and how it ends', async () => {
    const mock = await play();
    const page = await visit(mock.address);
    await page.fill('.condition', 'torque(LKneeSag) > 40Nm');
    await page.click('button:text-is("Back until")');
    await until(page, 'searching backwards… The emergency stop ends it. 1 s');
    assert.equal(await page.textContent('.link'), 'searching backwards');
    assert.equal(await page.isVisible('.measured'), false);
    await shot(page, 'studio-searching');
    await page.click('.estop');
    await until(page, 'a stop was asked for meanwhile');
    await page.waitForFunction(() => document.querySelector('.link').textContent === 'live');
    await leave(page);
  });
});
