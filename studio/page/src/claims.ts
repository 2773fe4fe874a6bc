// Joints that controllers have claimed: nothing else can lead them.

export interface Claims {
  /** Those that nobody has. */
  free: string[];
  /** Who has the others; empty: there are none. */
  words: string;
}

/** @param controllerOf who has a joint; empty: nobody. */
export function claimsOf(joints: string[], controllerOf: (joint: string) => string): Claims {
  const free = joints.filter((joint) => controllerOf(joint) === '');
  const claimed = joints.filter((joint) => controllerOf(joint) !== '');
  const who = [...new Set(claimed.map(controllerOf))].join(', ');
  return { free, words: claimed.length > 0 ? `Claimed by ${who}: ${claimed.join(', ')}.` : '' };
}
