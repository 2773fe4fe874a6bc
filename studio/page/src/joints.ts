// All joints on one page, by limb: what each does, and, with control, a safe hand on it.
import type { Actions } from './actions';
import type { ControlLease } from './control';
import { saveFile } from './csv';
import type { Data } from './data';
import { attribute, h, say } from './dom';
import { wordOf } from './enums';
import { fixed, number, plain, short } from './format';
import { GroupBar } from './group';
import { jointDrive } from './joint_drive';
import { JointTuning } from './joint_tuning';
import { jointsBefore, limbsOf, type TreeJoint } from './limbs';
import type { Answer, JointInfo } from './protocol';
import { SiteJog } from './site_jog';

const kFields = [
  'position_rad',
  'torque_Nm',
  'current_A',
  'temperature_C',
  'mode',
  'drive_state',
  'age_cycles',
  'fault',
];
/** A sample that is older [cycles] is lost: docs/json.md, `feedback`. */
const kLost_cycles = 10;
const kWarm_C = 80;

/** With its unit; "–" where there is none. */
export function figure(value: number, unit: string): string {
  return Number.isFinite(value) ? `${short(value)} ${unit}` : '–';
}

/** How old a joint's sample is [cycles]. @param measured whether there was one at all */
export function ageWords(old: number, measured: boolean): string {
  if (!Number.isFinite(old)) return '–';
  if (!measured) return 'never';
  if (old > kLost_cycles) return `lost, ${old}`;
  return old > 0 ? `old, ${old}` : 'fresh';
}

interface Row {
  joint: JointInfo;
  element: HTMLElement;
  ids: Record<string, number>;
  mode: HTMLElement;
  place: HTMLElement;
  goal: HTMLElement;
  position: HTMLElement;
  torque: HTMLElement;
  current: HTMLElement;
  temperature: HTMLElement;
  age: HTMLElement;
  who: HTMLElement;
  free: HTMLElement;
  /** What moves it, while it is open. */
  moves: HTMLFieldSetElement | null;
  opener: HTMLButtonElement;
  panel: HTMLElement;
  tuning: JointTuning | null;
}

export class Joints {
  private rows: Row[] = [];
  /** Of `joint.list`, by name: as the run told them last. */
  private told = new Map<unknown, Record<string, unknown>>();
  private readonly group: GroupBar;
  private readonly jog: SiteJog;
  private readonly halt: HTMLFieldSetElement;
  private tree: TreeJoint[] = [];
  private readonly body = h('div', { class: 'limbs' });
  private readonly filter = h('input', {
    type: 'search',
    class: 'search',
    placeholder: 'Filter joints: knee',
    'aria-label': 'filter joints',
    oninput: () => this.applyFilter(),
  });
  readonly element: HTMLElement;

  constructor(
    private readonly data: Data,
    private readonly actions: Actions,
    private readonly lease: ControlLease,
  ) {
    const controllerOf = (name: string) => String(this.told.get(name)?.controller ?? '');
    this.group = new GroupBar(
      actions,
      () => this.rows.filter((row) => !row.element.hidden).map((row) => row.joint.name),
      controllerOf,
    );
    this.jog = new SiteJog(actions, controllerOf);
    this.halt = h(
      'fieldset',
      {},
      actions.button('Halt all', () => ({ do: 'joint.halt' }), {
        title: 'Every joint that an operator moves brakes. It needs no control.',
      }),
    );
    this.element = h(
      'div',
      { class: 'joints' },
      h(
        'div',
        { class: 'toolbar' },
        lease.element,
        this.halt,
        h(
          'button',
          {
            type: 'button',
            class: 'asks-run',
            hidden: !actions.source.live,
            title:
              'Gains, stiffness and damping as they are now, for robot.toml:\ntandem joint tuning',
            onclick: () => void this.save(),
          },
          'Save gains as TOML',
        ),
        this.filter,
      ),
      this.group.element,
      this.jog.element,
      h(
        'p',
        { class: 'key muted' },
        h('span', { class: 'key-place' }),
        ' position',
        h('span', { class: 'of-a-run' }, '  ', h('span', { class: 'key-goal' }), ' reference'),
        '; the bar ends at the limits.',
      ),
      this.body,
    );
    data.whenCatalog(() => this.build());
    data.source.on({ watched: (request, answer) => this.watched(request, answer) });
    lease.on(() => this.allow());
  }

  setTree(tree: TreeJoint[]): void {
    this.tree = tree;
    this.build();
  }

  /** At each frame that has new values, while the panel is seen. */
  update(): void {
    for (const row of this.rows) this.show(row);
  }

  /** What it needs; nothing while it is not seen. */
  want(seen: boolean): void {
    const ids = this.rows.flatMap((row) => Object.values(row.ids)).filter((id) => id >= 0);
    this.data.want('joints', seen ? ids : []);
  }

  private build(): void {
    const joints = new Map((this.data.hello?.joints ?? []).map((joint) => [joint.name, joint]));
    this.rows = [];
    const groups = limbsOf([...joints.keys()], this.tree);
    const limbs = groups.map((limb) =>
      h(
        'section',
        { class: 'limb', 'aria-label': limb.name },
        h('h2', {}, limb.name),
        h(
          'div',
          { class: 'joint-head', 'aria-hidden': 'true' },
          ...['joint', 'mode', 'position', '', 'torque', 'current', 'winding', 'sample', ''].map(
            (head) => h('span', {}, head),
          ),
        ),
        ...limb.joints.map((name) => this.row(joints.get(name) as JointInfo)),
      ),
    );
    this.body.replaceChildren(...limbs);
    this.group.setRobot(
      [...joints.keys()],
      new Map(groups.map((limb) => [limb.name, limb.joints])),
      this.data.hello?.postures ?? [],
    );
    const moved = new Set((this.data.hello?.joints ?? []).map((joint) => joint.name));
    const led = (link: string) => jointsBefore(link, this.tree).some((name) => moved.has(name));
    const sites = this.data.hello?.sites ?? [];
    this.jog.setSites(
      this.tree.length === 0 ? sites : sites.filter(({ link }) => led(link)),
      this.tree,
    );
    this.applyFilter();
    this.allow();
    if (this.element.offsetParent) this.want(true);
  }

  private row(joint: JointInfo): HTMLElement {
    const id = (name: string) => this.data.catalog.named(name)?.id ?? -1;
    const ids: Record<string, number> = { goal: id(`command.position_rad.${joint.name}`) };
    for (const field of kFields) {
      ids[field] = this.data.catalog.ofJoint(field, joint.name)?.id ?? -1;
    }
    const cell = (kind: string) => h('span', { class: `cell ${kind}` }, '–');
    const place = h('span', { class: 'mark place' });
    const goal = h('span', { class: 'mark reference' });
    const panel = h('div', { class: 'panel', hidden: true });
    const opener = h(
      'button',
      {
        type: 'button',
        class: 'opener asks-run',
        'aria-expanded': 'false',
        'aria-label': `move ${joint.name}`,
      },
      'Move',
    );
    const who = h('p', { class: 'who muted' });
    const free = this.actions.button(
      'Stop its controller',
      () => {
        const name = who.dataset.controller;
        return name ? { do: 'controller.stop', name } : null;
      },
      {
        name: `stop its controller: ${joint.name}`,
        title: 'Its joints are held, and free to move from here.',
        ask: () => {
          const name = who.dataset.controller ?? '';
          const its = this.rows.filter((row) => row.who.dataset.controller === name);
          const count = its.length === 1 ? '1 joint' : `${its.length} joints`;
          return `${name} stops: what it does with ${count} ends, and they are held where they are.`;
        },
      },
    );
    free.hidden = true;
    const row: Row = {
      joint,
      ids,
      place,
      goal,
      panel,
      opener,
      who,
      free,
      tuning: null,
      moves: null,
      mode: cell('mode'),
      position: cell('position'),
      torque: cell('torque'),
      current: cell('current'),
      temperature: cell('temperature'),
      age: cell('age'),
      element: h('div', { class: 'joint', 'data-joint': joint.name }),
    };
    opener.addEventListener('click', () => this.toggle(row));
    row.element.append(
      h(
        'div',
        { class: 'joint-line' },
        h('span', { class: 'cell name', title: `${joint.name} [${joint.unit}]` }, joint.name),
        row.mode,
        h(
          'span',
          { class: 'bar-box' },
          h('span', { class: 'end' }, plain(joint.lower)),
          h('span', { class: 'bar' }, goal, place),
          h('span', { class: 'end' }, plain(joint.upper)),
        ),
        row.position,
        row.torque,
        row.current,
        row.temperature,
        row.age,
        opener,
      ),
      panel,
    );
    this.rows.push(row);
    return row.element;
  }

  private toggle(row: Row): void {
    const open = row.panel.hidden;
    row.panel.hidden = !open;
    attribute(row.opener, 'aria-expanded', String(open));
    row.tuning = null;
    row.moves = null;
    if (!open) return;
    const { moves, resets } = jointDrive(row.joint, this.actions, () =>
      this.data.latest(row.ids.position_rad),
    );
    row.moves = moves;
    row.tuning = new JointTuning(row.joint, this.actions, this.told.get(row.joint.name) ?? {});
    row.panel.replaceChildren(
      row.who,
      row.free,
      h('fieldset', { class: 'drive-box asks-run' }, moves, resets, row.tuning.element),
    );
    this.allow();
  }

  private show(row: Row): void {
    const value = (field: string) => this.data.latest(row.ids[field]);
    const { unit } = row.joint;
    const force = unit === 'm' ? 'N' : 'Nm';
    const position = value('position_rad');
    const goal = value('goal');
    this.mark(row.place, row.joint, position);
    this.mark(row.goal, row.joint, goal);
    say(row.position, Number.isFinite(position) ? `${fixed(position, 3)} ${unit}` : '–');
    row.position.title = `position ${number(position)}, reference ${number(goal)} ${unit}`;
    say(row.torque, figure(value('torque_Nm'), force));
    say(row.current, figure(value('current_A'), 'A'));
    const warm = value('temperature_C');
    say(
      row.temperature,
      Number.isFinite(warm) ? `${fixed(warm, 0)} °C${warm > kWarm_C ? ' hot' : ''}` : '–',
    );
    const fault = value('fault');
    const state = value('drive_state');
    const mode = wordOf('mode', value('mode'));
    const enabled = state === 5;
    say(
      row.mode,
      fault > 0 ? `fault ${wordOf('fault', fault)}` : enabled ? mode : wordOf('drive_state', state),
    );
    const old = value('age_cycles');
    const lost = old > kLost_cycles;
    say(row.age, ageWords(old, Number.isFinite(position)));
    row.element.classList.toggle('lost', lost || !Number.isFinite(position));
    row.element.classList.toggle('faulted', fault > 0);
    row.element.classList.toggle('warm', warm > kWarm_C);
  }

  private mark(mark: HTMLElement, joint: JointInfo, value: number): void {
    const low = joint.lower ?? -Math.PI;
    const high = joint.upper ?? Math.PI;
    const share = (value - low) / (high - low);
    mark.hidden = !Number.isFinite(share);
    if (!mark.hidden) mark.style.left = `${(100 * Math.min(1, Math.max(0, share))).toFixed(2)}%`;
    mark.classList.toggle('outside', share < 0 || share > 1);
  }

  private watched(request: string, answer: Answer): void {
    if (request !== 'joint.list' || !answer.ok) return;
    const list = answer.joints as Record<string, unknown>[];
    this.told = new Map(list.map((joint) => [joint.joint, joint]));
    for (const row of this.rows) {
      const joint = this.told.get(row.joint.name);
      if (!joint) continue;
      row.tuning?.tell(joint);
      const controller = String(joint.controller ?? '');
      row.who.dataset.controller = controller;
      row.free.hidden = controller === '';
      attribute(row.element, 'data-moving', String(joint.moving === true));
      attribute(row.element, 'data-controller', controller);
    }
    this.allow();
  }

  /** Who leads it, and why it cannot be moved from here. */
  private leadOf(row: Row): string {
    const joint = this.told.get(row.joint.name) ?? {};
    const controller = String(joint.controller ?? '');
    const homing = joint.homing && joint.homing !== 'none' ? `; ${joint.homing}` : '';
    const fault = joint.fault_text ? `; ${joint.fault_text}` : '';
    const moves = joint.moving ? 'moving' : 'standing';
    const lead = controller
      ? `Claimed by ${controller}: it cannot be moved from here.${fault}`
      : `Free, ${moves}${homing}${fault}`;
    return this.lease.mine ? lead : `${lead.replace(/\.?$/, '.')} ${this.lease.whyNotMine}`;
  }

  private allow(): void {
    for (const box of this.body.querySelectorAll<HTMLFieldSetElement>('.drive-box'))
      box.disabled = !this.lease.mine;
    for (const row of this.rows) {
      if (!row.moves) continue;
      const claimed = row.who.dataset.controller ?? '';
      row.moves.disabled = claimed !== '';
      say(row.who, this.leadOf(row));
      // Of a screen reader: why what is disabled is.
      attribute(
        row.moves,
        'aria-description',
        claimed || !this.lease.mine ? this.leadOf(row) : null,
      );
    }
    const may = this.lease.mayChange;
    this.halt.disabled = !may;
    for (const row of this.rows) {
      const free = row.free.querySelector('button');
      if (free) free.disabled = !may;
    }
    this.group.element.disabled = !this.lease.mine;
    this.group.count();
    this.jog.element.disabled = !this.lease.mine;
    this.jog.allow();
  }

  private async save(): Promise<void> {
    const answer = await this.actions.run({ do: 'joint.tuning' });
    if (!answer.ok) return;
    const changed = (answer.changed as string[]) ?? [];
    saveFile(`${this.data.hello?.robot ?? 'robot'}_gains.toml`, 'text/plain', String(answer.toml));
    const words = changed.length === 0 ? 'nothing was changed' : `changed: ${changed.join(', ')}`;
    this.actions.tell('tandem joint tuning', `saved; ${words}`);
  }

  private applyFilter(): void {
    const words = this.filter.value.toLowerCase().split(/\s+/).filter(Boolean);
    for (const limb of this.body.querySelectorAll<HTMLElement>('.limb')) {
      const name = (limb.getAttribute('aria-label') ?? '').toLowerCase();
      let any = false;
      for (const joint of limb.querySelectorAll<HTMLElement>('.joint')) {
        const text = `${name} ${(joint.dataset.joint ?? '').toLowerCase()}`;
        joint.hidden = !words.every((word) => text.includes(word));
        any ||= !joint.hidden;
      }
      limb.hidden = !any;
    }
    this.group.count();
  }
}
