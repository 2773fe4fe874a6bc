// The centre of pressure of all feet together.

/**
 * Where on the ground the forces of all feet have no moment about a horizontal axis: the centre of
 * pressure, for feet on one level the zero-moment point.
 * @param feet their origins [m], `forces` [N] and `moments` [Nm] about these: x, y, z of each foot,
 *   world axes
 * @param ground its height [m]
 * @returns x, y, z [m]; null: no foot carries anything, or it is not known
 */
export function pressureCentre(
  feet: number[],
  forces: number[],
  moments: number[],
  ground: number,
): [number, number, number] | null {
  let [fx, fy, fz, mx, my] = [0, 0, 0, 0, 0];
  for (let i = 0; i + 2 < forces.length; i += 3) {
    const [x, y, z] = feet.slice(i, i + 3);
    const [ax, ay, az] = forces.slice(i, i + 3);
    fx += ax;
    fy += ay;
    fz += az;
    // About the world's origin: M + r x F.
    mx += moments[i] + y * az - z * ay;
    my += moments[i + 1] + z * ax - x * az;
  }
  if (!(fz > kLeast_N)) return null;
  const at: [number, number, number] = [(ground * fx - my) / fz, (ground * fy + mx) / fz, ground];
  return at.every(Number.isFinite) ? at : null;
}

/** Height of the ground under a place of the world [m]. */
export type GroundHeight = (x: number, y: number) => number;

/** The same on ground that is not level: where the line of the centre meets it, nearly. */
export function centreOn(
  ground: GroundHeight,
  feet: number[],
  forces: number[],
  moments: number[],
): [number, number, number] | null {
  let at: [number, number, number] | null = [feet[0] ?? 0, feet[1] ?? 0, 0];
  for (let i = 0; i < kTurns && at; ++i) {
    at = pressureCentre(feet, forces, moments, ground(at[0], at[1]));
  }
  return at;
}

/** On a plane of 10 degrees each comes ten times nearer or more. */
const kTurns = 4;
/** Less than that is noise, and its centre anywhere. */
const kLeast_N = 1;
