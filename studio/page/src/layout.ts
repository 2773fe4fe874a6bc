// Which panes show which series: kept in the browser, saved as a file, or made of what a robot has.
import { limbsOf } from './limbs';
import type { Hello } from './protocol';
import { readScope, type ScopeSettings } from './scope_settings';
import type { Series } from './series';
import type { Catalog } from './signals';

export interface Layout {
  version: 1;
  width_s: number;
  panes: { series: Series[] }[];
  /** Absent: a preset of plots, which leaves the oscilloscope alone. */
  scope?: ScopeSettings;
}

const kKey = 'tandem.studio.layout';
const kMostPanes = 12;
const kMostSeries = 16;

function seriesOf(value: unknown): Series | null {
  const one = value as Partial<Record<string, unknown>> | null;
  if (typeof one?.name !== 'string') return null;
  if (one.kind === 'signal' || one.kind === 'derivative') return { kind: one.kind, name: one.name };
  if (one.kind === 'difference' && typeof one.minus === 'string') {
    return { kind: 'difference', name: one.name, minus: one.minus };
  }
  return null;
}

/** A layout of a text. @throws Error in words: what is wrong with it. */
export function readLayout(text: string): Layout {
  let value: { version?: unknown; width_s?: unknown; panes?: unknown; scope?: unknown };
  try {
    value = JSON.parse(text);
  } catch {
    throw new Error('the file is no JSON');
  }
  if (value?.version !== 1) throw new Error('the file is no layout of version 1');
  if (!Array.isArray(value.panes)) throw new Error('the layout has no list "panes"');
  const panes = value.panes.slice(0, kMostPanes).map((pane) => {
    const list = Array.isArray(pane?.series) ? (pane.series as unknown[]) : [];
    const series = list.slice(0, kMostSeries).map(seriesOf);
    return { series: series.filter((one): one is Series => one !== null) };
  });
  const width = Number(value.width_s);
  return {
    version: 1,
    width_s: width >= 1 && width <= 60 ? width : 10,
    panes,
    ...(value.scope === undefined ? {} : { scope: readScope(value.scope) }),
  };
}

/** The layout of this robot that the browser keeps; null: none, or one that cannot be read. */
export function keptLayout(robot: string): Layout | null {
  try {
    const text = localStorage.getItem(`${kKey}.${robot}`);
    return text ? readLayout(text) : null;
  } catch {
    return null;
  }
}

export function keepLayout(robot: string, layout: Layout): void {
  try {
    localStorage.setItem(`${kKey}.${robot}`, JSON.stringify(layout));
  } catch {
    // A browser that keeps nothing: the next page begins with the preset.
  }
}

const signal = (name: string): Series => ({ kind: 'signal', name });

/** Joints of the legs, else of the first limb, at most so many. */
function someJoints(hello: Hello, most: number): string[] {
  const limbs = limbsOf(hello.joints.map((joint) => joint.name));
  const leg = limbs.find((limb) => limb.name.includes('leg')) ?? limbs[0];
  return (leg?.joints ?? []).slice(0, most);
}

export const kPresets: Record<string, (hello: Hello, catalog: Catalog) => Layout> = {
  overview: (hello, catalog) => {
    const joints = someJoints(hello, 3);
    const of = (fields: string[], names: string[]) =>
      names.flatMap((joint) => fields.map((field) => signal(`${field}.${joint}`)));
    const controllers = catalog.signals.filter(
      (one) => one.source.startsWith('controller/') && !/^(cycle|time_ns)$/.test(one.field),
    );
    return existing(catalog, [
      of(['state.position_rad', 'command.position_rad'], joints.slice(0, 2)),
      of(['state.torque_Nm'], joints),
      // Of an emulation: what is so there, and what its wire carries.
      ...(hello.emulated
        ? [
            of(['truth.position_rad'], joints),
            of(['truth.torque_Nm'], joints),
            catalog
              .idsOf('boards', 'wire_load')
              .map((id) => signal(catalog.withId(id)?.name ?? '')),
            of(['boards.mode', 'boards.drive_state'], joints.slice(0, 1)),
          ]
        : []),
      controllers.slice(0, 3).map((one) => signal(one.name)),
      of(['state.mode', 'state.drive_state'], joints.slice(0, 1)),
    ]);
  },
  'legs torque': (hello, catalog) => {
    const limbs = limbsOf(hello.joints.map((joint) => joint.name));
    const legs = limbs.filter((limb) => limb.name.includes('leg'));
    const chosen = legs.length > 0 ? legs : limbs.slice(0, 2);
    return existing(
      catalog,
      chosen.map((limb) =>
        limb.joints.map((joint) => signal(catalog.ofJoint('torque_Nm', joint)?.name ?? '')),
      ),
    );
  },
};

/** Panes of the series that the run has; those without any are left out. */
function existing(catalog: Catalog, panes: Series[][]): Layout {
  const kept = panes
    .map((series) => ({
      series: series
        .flatMap((one) => catalog.named(one.name) ?? [])
        .map((found) => signal(found.name))
        .slice(0, kMostSeries),
    }))
    .filter((pane) => pane.series.length > 0);
  return { version: 1, width_s: 10, panes: kept.length > 0 ? kept : [{ series: [] }] };
}
