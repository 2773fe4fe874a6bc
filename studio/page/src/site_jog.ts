// Leads a site of the robot by buttons that are held: along and about the axes of base or site.
import type { Actions } from './actions';
import { claimsOf } from './claims';
import { attribute, h, say } from './dom';
import { Held, holdToMove, kAhead_s } from './jog';
import { jointsBefore, type TreeJoint } from './limbs';
import type { SiteInfo } from './protocol';

interface Axis {
  name: string;
  label: string;
  turns: boolean;
}
const kAxes: Axis[] = [
  { name: 'x', label: 'x', turns: false },
  { name: 'y', label: 'y', turns: false },
  { name: 'z', label: 'z', turns: false },
  { name: 'roll', label: 'roll', turns: true },
  { name: 'pitch', label: 'pitch', turns: true },
  { name: 'yaw', label: 'yaw', turns: true },
];
const kLeast_m_s = 0.005;
const kMost_m_s = 0.2;
/** Of a turn, for each m/s of the speed: what a hand's length makes of it. */
const kTurn_rad_m = 4;

export class SiteJog {
  private sites: SiteInfo[] = [];
  private tree: TreeJoint[] = [];
  private readonly site = h('select', {
    'aria-label': 'site to lead',
    onchange: () => this.allow(),
  });
  private readonly axes = h(
    'select',
    { 'aria-label': 'axes' },
    h('option', { value: 'base' }, 'base'),
    h('option', { value: 'site' }, 'site'),
  );
  private readonly speed = h('input', {
    type: 'number',
    class: 'short',
    min: kLeast_m_s,
    max: kMost_m_s,
    step: 0.005,
    value: 0.05,
    'aria-label': 'speed of the site [m/s]',
  });
  private readonly why = h('span', { class: 'muted', role: 'status' });
  private readonly moves: HTMLFieldSetElement;
  readonly element: HTMLFieldSetElement;

  /** @param controllerOf who has a joint; empty: nobody. */
  constructor(
    private readonly actions: Actions,
    private readonly controllerOf: (joint: string) => string,
  ) {
    this.moves = h(
      'fieldset',
      {},
      ...kAxes.map((axis) =>
        h(
          'span',
          { class: 'group', role: 'group', 'aria-label': `hold to lead: ${axis.name}` },
          ...([-1, 1] as const).map((direction) => this.button(axis, direction)),
        ),
      ),
    );
    this.element = h(
      'fieldset',
      { class: 'toolbar site-jog asks-run', disabled: true, hidden: true },
      h('legend', {}, 'Lead a site'),
      this.site,
      h('label', {}, 'axes of the ', this.axes),
      h('label', {}, 'at ', this.speed, ' m/s'),
      this.moves,
      this.why,
    );
  }

  /** @param tree of the description; empty: nobody knows which joints lead a site */
  setSites(sites: SiteInfo[], tree: TreeJoint[]): void {
    this.sites = sites;
    this.tree = tree;
    const before = this.site.value;
    this.site.replaceChildren(...sites.map(({ name }) => h('option', { value: name }, name)));
    if (sites.some(({ name }) => name === before)) this.site.value = before;
    this.element.hidden = sites.length === 0;
    this.allow();
  }

  /** A controller came or went, or another site is to be led. */
  allow(): void {
    const site = this.sites.find(({ name }) => name === this.site.value);
    const joints = site ? jointsBefore(site.link, this.tree) : [];
    const { words } = claimsOf(joints, this.controllerOf);
    const why = words && `${words} ${this.site.value} cannot be led from here.`;
    this.moves.disabled = why !== '';
    attribute(this.moves, 'aria-description', why || null);
    say(this.why, why);
  }

  private button(axis: Axis, direction: 1 | -1): HTMLElement {
    const sign = direction > 0 ? '+' : '−';
    const button = h(
      'button',
      {
        type: 'button',
        class: 'hold short-hold',
        'aria-label': `${sign}${axis.label}: hold to lead the site`,
        title: `Moves while it is held, goals at most ${kAhead_s} s ahead; stops at release.`,
      },
      `${sign}${axis.label}`,
    );
    const held = new Held(
      (request) => this.actions.source.ask(request),
      (way) => {
        const along = this.speedOf();
        if (Number.isNaN(along)) return null;
        const speed = axis.turns ? kTurn_rad_m * along : along;
        return {
          do: 'site.move',
          site: this.site.value,
          axis: axis.name,
          by: Number((way * speed * kAhead_s).toFixed(6)),
          axes: this.axes.value,
          speed: Number(speed.toFixed(6)),
        };
      },
      { do: 'joint.halt' },
      (request, answer) => this.actions.show(request, answer),
    );
    holdToMove(button, held, direction, () => {
      const known = !Number.isNaN(this.speedOf());
      if (!known) {
        const words = `'${this.speed.value}' is no speed of a site: ${kLeast_m_s} to ${kMost_m_s} m/s`;
        this.actions.tell('', words, true);
      }
      return known;
    });
    return button;
  }

  /** As typed [m/s]; NaN: it is none that a site may have. */
  private speedOf(): number {
    const speed = Number(this.speed.value);
    return speed >= kLeast_m_s && speed <= kMost_m_s ? speed : Number.NaN;
  }
}
