// Of an emulation: what it is, who leads it, and how its master is. Of a run it is not shown.
import type { Data } from './data';
import { h, say } from './dom';
import type { Hello } from './protocol';

/** Tabs that have something: an emulation has no controllers, no inputs and no loop. */
export const kEmulationTabs = ['plots', 'scope', 'joints', 'events'];

const kFields = ['synced', 'all_enabled', 'slipped'] as const;
const kNoLoad =
  'wire_load is not measured of EtherCAT in lockstep: a master sends its frames again for as long as a step takes.';
type Field = (typeof kFields)[number];

/** How it is, in words. @param stands time does: nothing is stepped. */
export function emulationWords(value: (field: Field) => number, stands: boolean): string {
  const master = stands
    ? 'Time stands until a master sends SYNC.'
    : value('synced') > 0
      ? 'A master sends SYNC.'
      : 'No SYNC: the clocks of the boards go on by themselves.';
  const axes = value('all_enabled') > 0 ? 'All axes are enabled.' : 'Not all axes are enabled.';
  const slipped = value('slipped');
  const late = slipped > 0 ? ` ${slipped} steps were left out: this machine is too slow.` : '';
  return `${master} ${axes}${late}`;
}

export class EmulationPanel {
  private ids: Partial<Record<Field, number>> = {};
  private readonly run = h('code', {});
  private readonly words = h('p', { class: 'emulation-words', role: 'status' });
  private loads: number[] = [];
  private readonly load = h('p', { class: 'muted', hidden: true }, kNoLoad);
  readonly element = h(
    'section',
    { class: 'emulation-panel', 'aria-label': 'emulation', hidden: true },
    h(
      'p',
      {},
      h('strong', {}, 'An emulation'),
      ': simulated boards and robot. You only look: control is on the other side of the wire, ',
      this.run,
    ),
    this.words,
    this.load,
  );

  constructor(private readonly data: Data) {
    data.whenHello((hello: Hello) => {
      this.element.hidden = !hello.emulated;
      document.body.toggleAttribute('data-emulated', !!hello.emulated);
      say(this.run, `tandem run … --hal ${hello.emulated} --studio`);
    });
    data.whenCatalog(() => {
      const found = kFields.map((field) => [
        field,
        data.catalog.named(`boards.${field}`)?.id ?? -1,
      ]);
      this.ids = Object.fromEntries(found);
      this.loads = data.catalog.idsOf('boards', 'wire_load');
      data.want('emulation', [...Object.values(this.ids).filter((id) => id >= 0), ...this.loads]);
    });
  }

  /** At each frame that has new values. */
  update(): void {
    const stands = this.data.lastTick?.paused === true;
    const words = emulationWords((field) => this.data.latest(this.ids[field] ?? -1), stands);
    if (this.element.hidden) return;
    say(this.words, words);
    const known = this.loads.every((id) => Number.isFinite(this.data.latest(id)));
    this.load.hidden = known || this.data.hello?.emulated !== 'ethercat';
  }
}
