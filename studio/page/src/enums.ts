// Words of the numbers that stand for something: modes, states, yes and no.

const kNames: Record<string, string[]> = {
  mode: ['idle', 'position', 'velocity', 'torque', 'open_loop', 'current'],
  interaction: ['stiff', 'compliant'],
  drive_state: [
    'unknown',
    'not ready to switch on',
    'switch on disabled',
    'ready to switch on',
    'switched on',
    'operation enabled',
    'quick stop active',
    'fault reaction active',
    'fault',
  ],
  homing: ['none', 'not homed', 'under way', 'homed'],
  phase: [
    'bring-up',
    'settling',
    'running',
    'faulted',
    'resetting',
    'shut down',
    'done',
    'held',
    'retreating',
  ],
  collided: ['free', 'collided'],
  base_collided: ['free', 'collided'],
  base_valid: ['not valid', 'valid'],
  fault_reset: ['no', 'reset'],
};

/** Whether a field is drawn as a lane of words instead of a line. */
export function isLane(field: { name: string; type: string }): boolean {
  return field.name in kNames || field.name === 'fault' || /^([iu]8|bool)$/.test(field.type);
}

/** What a value of such a field means. */
export function wordOf(field: string, value: number): string {
  if (!Number.isFinite(value)) return '–';
  if (field === 'fault') {
    return value === 0 ? 'none' : `0x${Math.round(value).toString(16).toUpperCase()}`;
  }
  return kNames[field]?.[value] ?? String(value);
}
