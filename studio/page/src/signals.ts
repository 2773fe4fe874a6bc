// The table of a run's signals, their names, and the search in it.
import { isLane } from './enums';
import type { Field, JointInfo, SourceTable } from './protocol';

export interface Signal {
  id: number;
  /** "state.position_rad.LHipSag" */
  name: string;
  source: string;
  field: string;
  element: string;
  unit: string;
  doc: string;
  /** Its values are words: a mode, a state. */
  lane: boolean;
}

interface Entry {
  signal: Signal;
  name: string;
  words: string[];
  rest: string;
}

/** The words of a name: "state.torque_Nm.LKneeSag" gives state, torque, nm, l, knee, sag. */
export function wordsOf(name: string): string[] {
  return name
    .replace(/([a-z0-9])([A-Z])/g, '$1 $2')
    .replace(/([A-Z])([A-Z][a-z])/g, '$1 $2')
    .toLowerCase()
    .split(/[^\p{L}\p{N}]+/u)
    .filter((word) => word !== '');
}

function elementName(field: Field, index: number): string {
  if (field.elements) return field.elements[index] ?? String(index);
  return field.count === 1 ? '' : String(index);
}

/** What of a joint says its units. */
type Joint = Pick<JointInfo, 'name' | 'unit'>;

/**
 * "Nm or N" is the unit of what turns, then of what slides: the one of this element. Where it is no
 * joint's, that of all joints when they are alike.
 */
export function unitOf(unit: string, element: string, joints: Joint[]): string {
  const [turns, slides] = unit.split(' or ');
  if (slides === undefined) return unit;
  const its = joints.filter((joint) => joint.name === element);
  const kinds = new Set((its.length > 0 ? its : joints).map((joint) => joint.unit === 'm'));
  if (kinds.size !== 1) return unit;
  return kinds.has(true) ? slides : turns;
}

export class Catalog {
  readonly revision: number;
  readonly signals: Signal[] = [];
  private readonly byName = new Map<string, Signal>();
  private readonly byLower = new Map<string, Signal>();
  private readonly byId = new Map<number, Signal>();
  private readonly entries: Entry[] = [];

  /** @param joints of the robot: they say their signals' units */
  constructor(
    revision = 0,
    sources: SourceTable[] = [],
    private readonly joints: Joint[] = [],
  ) {
    this.revision = revision;
    for (const source of sources) {
      let id = source.first;
      for (const field of source.fields) {
        for (let i = 0; i < field.count; ++i) this.add(source.name, field, i, id++);
      }
    }
  }

  /** The signal of a full name, in capital or small letters: a log has torque_Nm, ROS torque_nm. */
  named(name: string): Signal | undefined {
    return this.byName.get(name) ?? this.byLower.get(name.toLowerCase());
  }
  /** A joint's signal: as a run has it, else as the boards and the plant of an emulation do. */
  ofJoint(field: string, joint: string): Signal | undefined {
    for (const source of ['state', 'boards', 'truth']) {
      const found = this.named(`${source}.${field}.${joint}`);
      if (found) return found;
    }
    return undefined;
  }
  withId(id: number): Signal | undefined {
    return this.byId.get(id);
  }
  /** Ids of a field's numbers in their order; empty when there is no such field. */
  idsOf(source: string, field: string): number[] {
    const wanted = field.toLowerCase();
    return this.signals
      .filter((one) => one.source === source && one.field.toLowerCase() === wanted)
      .map((one) => one.id);
  }

  /**
   * The signals that have every word of the query, in any order, in name, unit or meaning. Those
   * whose names have them come first, of these the ones with whole words.
   */
  search(query: string, most = 60): Signal[] {
    const wanted = query
      .toLowerCase()
      .split(/\s+/)
      .filter((word) => word !== '');
    if (wanted.length === 0) return [];
    const found: { signal: Signal; score: number; order: number }[] = [];
    this.entries.forEach((entry, order) => {
      let score = 0;
      for (const word of wanted) {
        if (entry.words.includes(word)) score += 6;
        else if (entry.words.some((own) => own.startsWith(word))) score += 4;
        else if (entry.name.includes(word)) score += 3;
        else if (entry.rest.includes(word)) score += 1;
        else return;
      }
      if (entry.signal.source === 'state') score += 0.5;
      found.push({ signal: entry.signal, score, order });
    });
    found.sort((a, b) => b.score - a.score || a.order - b.order);
    return found.slice(0, most).map((one) => one.signal);
  }

  private add(source: string, field: Field, index: number, id: number): void {
    const element = elementName(field, index);
    const name = [source, field.name, element].filter((part) => part !== '').join('.');
    const signal: Signal = {
      id,
      name,
      source,
      field: field.name,
      element,
      unit: unitOf(field.unit, element, this.joints),
      doc: field.doc,
      lane: isLane(field),
    };
    this.signals.push(signal);
    this.byName.set(name, signal);
    if (!this.byLower.has(name.toLowerCase())) this.byLower.set(name.toLowerCase(), signal);
    this.byId.set(id, signal);
    // The bytes and counts of marks are for the 3D view alone.
    if (source.startsWith('marks/') && field.type === 'u8') return;
    this.entries.push({
      signal,
      name: name.toLowerCase(),
      words: wordsOf(name),
      rest: `${field.unit} ${field.doc}`.toLowerCase(),
    });
  }
}
