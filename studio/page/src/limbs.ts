// Which limb a joint belongs to, by its name or by its branch of the robot's tree.
import { wordsOf } from './signals';

export interface Limb {
  name: string;
  joints: string[];
}
export interface TreeJoint {
  name: string;
  parent: string;
  child: string;
}

const kLegs = /^(hip|knee|ank|ankle|leg|foot|thigh|shank|haa|hfe|kfe|toe|upperleg|lowerleg)j?\d*$/;
const kArms = /^(sh|shoulder|elb|elbow|arm|forearm|upperarm|wrj|wrist|prosup)j?\d*$/;
const kHands = /^(hand|finger|thumb|gripper)j?\d*$/;
const kWaist = /^(waist|torso|chest|spine)$/;
const kNeck = /^(neck|head|gaze|eye|eyes)j?$/;
const kOrder = ['neck', 'head', 'waist', 'torso', 'arm', 'hand', 'leg'];

function sideOf(name: string): string {
  const quarter = /^([LR])([FH])_/.exec(name);
  if (quarter) return `${sideWord(quarter[1])} ${quarter[2] === 'F' ? 'front' : 'hind'}`;
  if (/^[LR][A-Z]/.test(name)) return sideWord(name[0]);
  const words = wordsOf(name);
  if (words.includes('left') || words.includes('l')) return 'left';
  if (words.includes('right') || words.includes('r')) return 'right';
  return '';
}

function sideWord(letter: string): string {
  return letter === 'L' ? 'left' : 'right';
}

/** "left leg", "waist"; empty: its name does not say. */
export function limbByName(name: string): string {
  const words = wordsOf(name);
  const is = (kind: RegExp) => words.some((word) => kind.test(word));
  if (is(kNeck)) return 'neck';
  if (is(kWaist)) return 'waist';
  let limb = '';
  if (is(kHands)) limb = 'hand';
  else if (is(kArms)) limb = 'arm';
  else if (is(kLegs)) limb = 'leg';
  if (limb === '') return '';
  const side = sideOf(name);
  return side === '' ? limb : `${side} ${limb}`;
}

/**
 * The top of the branch in which a joint is: the joint after the last place, seen from the root,
 * where the tree of the joints that matter forks.
 */
function branchOf(joint: string, parents: Map<string, string>, forks: Set<string>): string {
  let top = joint;
  for (const parent of towardsRoot(joint, parents)) {
    if (forks.has(parent)) break;
    top = parent;
  }
  return top;
}

/** The listed joints towards the root; of a ring, which is no tree, each once. */
function towardsRoot(joint: string, parents: Map<string, string>): string[] {
  const seen = new Set([joint]);
  for (let up = parents.get(joint); up !== undefined && !seen.has(up); up = parents.get(up)) {
    seen.add(up);
  }
  return [...seen].slice(1);
}

/** The joints that lead a link: from it to the root. */
export function jointsBefore(link: string, tree: TreeJoint[]): string[] {
  const byChild = new Map(tree.map((joint) => [joint.child, joint]));
  const before = new Set<string>(); // of a ring, which is no tree, each once
  let up = byChild.get(link);
  for (; up && !before.has(up.name); up = byChild.get(up.parent)) before.add(up.name);
  return [...before];
}

/** For each joint the nearest one of the list towards the root. */
function parentsAmong(names: string[], tree: TreeJoint[]): Map<string, string> {
  const listed = new Set(names);
  const byChild = new Map(tree.map((joint) => [joint.child, joint]));
  const byName = new Map(tree.map((joint) => [joint.name, joint]));
  const parents = new Map<string, string>();
  for (const name of names) {
    let up = byName.get(name);
    for (let steps = 0; up && steps <= tree.length; ++steps) {
      up = byChild.get(up.parent);
      if (up && listed.has(up.name)) {
        parents.set(name, up.name);
        break;
      }
    }
  }
  return parents;
}

/** Every joint once, in groups: those named by limb first, from head to foot. */
export function limbsOf(names: string[], tree: TreeJoint[] = []): Limb[] {
  const parents = parentsAmong(names, tree);
  const children = new Map<string, number>();
  for (const parent of parents.values()) children.set(parent, (children.get(parent) ?? 0) + 1);
  const forks = new Set([...children].filter(([, count]) => count > 1).map(([name]) => name));
  const roots = names.filter((name) => !parents.has(name)).length;
  const groups = new Map<string, string[]>();
  for (const name of names) {
    let limb = limbByName(name);
    for (const up of towardsRoot(name, parents)) if (limb === '') limb = limbByName(up);
    if (limb === '') {
      const chain = (tree.length === 0 || roots === 1) && forks.size === 0;
      limb = chain ? 'joints' : `from ${branchOf(name, parents, forks)}`;
    }
    groups.set(limb, [...(groups.get(limb) ?? []), name]);
  }
  const place = (limb: string) => {
    const found = kOrder.indexOf(limb.split(' ').at(-1) ?? '');
    return found < 0 ? kOrder.length : found;
  };
  return [...groups]
    .map(([name, joints]) => ({ name, joints }))
    .sort((a, b) => place(a.name) - place(b.name));
}
