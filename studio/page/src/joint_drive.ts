// What moves one joint: goal by number, keys and slider, hold-to-move, mode.
import type { Actions } from './actions';
import { h } from './dom';
import { number } from './format';
import { holdToMove, Jog, kAhead_s } from './jog';
import type { JointInfo, Request } from './protocol';

/** A goal as typed: "0.5", "30deg", "20 mm". NaN: none. In rad or m. */
export function parseGoal(text: string, unit: string): number {
  const match = /^\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:e[-+]?\d+)?)\s*([a-z°]*)\s*$/i.exec(text);
  if (!match) return Number.NaN;
  const scales: Record<string, number> =
    unit === 'm'
      ? { '': 1, m: 1, cm: 0.01, mm: 0.001 }
      : { '': 1, rad: 1, deg: Math.PI / 180, '°': Math.PI / 180 };
  return Number(match[1]) * (scales[match[2].toLowerCase()] ?? Number.NaN);
}

/** A speed as typed: "0.1", "15deg", "20 mm/s". NaN: none. In rad/s or m/s, above 0. */
export function parseSpeed(text: string, unit: string): number {
  const speed = parseGoal(text.replace(/\/\s*s\s*$/, ''), unit);
  return speed > 0 ? speed : Number.NaN;
}

/** A careful speed when nobody says one: a tenth of the limit. */
function carefulSpeed(joint: JointInfo): number {
  const limit = joint.velocity ?? 1;
  return Number(Math.min(0.1 * limit, joint.unit === 'm' ? 0.05 : 0.5).toPrecision(2));
}

const kSteps = [-0.1, -0.01, 0.01, 0.1];

/** @param position of the joint now. @returns what moves it, and what a claimed joint has as well. */
export function jointDrive(
  joint: JointInfo,
  actions: Actions,
  position: () => number,
): { moves: HTMLFieldSetElement; resets: HTMLElement } {
  const low = joint.lower ?? -Math.PI;
  const high = joint.upper ?? Math.PI;
  const { name, unit } = joint;
  const speed = h('input', {
    type: 'text',
    inputmode: 'decimal',
    class: 'short',
    value: carefulSpeed(joint),
    'aria-label': `speed of ${name} [${unit}/s]`,
  });
  const speedOf = () => parseSpeed(speed.value, unit);
  const whyNoSpeed = () =>
    Number.isFinite(speedOf())
      ? ''
      : `'${speed.value}' is no speed of ${name}: 0.1 or ${unit === 'm' ? '20mm' : '15deg'}, per second`;
  const goal = h('input', {
    type: 'text',
    inputmode: 'decimal',
    class: 'short',
    'aria-label': `goal of ${name} [${unit}]`,
    title: unit === 'm' ? '0.02, 20mm' : '0.5, 30deg',
  });
  const slider = h('input', {
    type: 'range',
    class: 'goal',
    min: low,
    max: high,
    step: (high - low) / 400,
    title: 'The joint goes there when it is let go.',
    'aria-label': `goal of ${name} [${unit}]`,
  });
  const inside = (value: number) => Math.min(high, Math.max(low, value));
  const move = (target: number): Request => ({
    do: 'joint.move',
    joint: name,
    target_rad: Number(target.toFixed(6)),
    speed_rad_s: speedOf(),
  });
  const set = (target: number) => {
    goal.value = number(target);
    slider.value = String(inside(target));
  };
  /** Why the joint does not go there; empty: it may. */
  const whyNot = (target: number): string => {
    if (!Number.isFinite(target)) {
      return `'${goal.value}' is no place of ${name}: 0.5 or ${unit === 'm' ? '20mm' : '30deg'}`;
    }
    const { lower, upper } = joint;
    if (target >= (lower ?? -Infinity) && target <= (upper ?? Infinity)) return whyNoSpeed();
    return `${number(target)} ${unit} is beyond the limits of ${name}: ${number(low)} to ${number(high)}`;
  };
  const go = (target: number) => {
    const why = whyNot(target);
    if (why) return actions.tell('', why, true);
    set(target);
    void actions.run(move(target));
  };
  slider.addEventListener('input', () => {
    goal.value = number(Number(slider.value));
  });
  slider.addEventListener('change', () => go(Number(slider.value)));
  goal.addEventListener('keydown', (event) => {
    if (event.key === 'Enter') go(parseGoal(goal.value, unit));
    else if (event.key === 'ArrowUp' || event.key === 'ArrowDown') {
      event.preventDefault();
      set((parseGoal(goal.value, unit) || 0) + (event.key === 'ArrowUp' ? 0.01 : -0.01));
    }
  });
  const current = position();
  if (Number.isFinite(current)) set(current);
  const steps = kSteps.map((step) =>
    h(
      'button',
      {
        type: 'button',
        'aria-label': `${name} by ${step} ${unit}`,
        onclick: () => go(inside(position() + step)),
      },
      step > 0 ? `+${step}` : `−${-step}`,
    ),
  );
  const jog = new Jog(
    (request) => actions.source.ask(request),
    { name, lower: joint.lower, upper: joint.upper, position, speed: speedOf },
    (request, answer) => {
      if (!answer.ok) actions.show(request, answer);
    },
  );
  const hold = (direction: 1 | -1, label: string) => {
    const button = h(
      'button',
      {
        type: 'button',
        class: 'hold',
        'aria-label': `hold to move ${name} ${direction > 0 ? 'up' : 'down'}`,
        title: `Moves while it is held, goals at most ${kAhead_s} s ahead; stops at release.`,
      },
      label,
    );
    holdToMove(button, jog, direction, () => {
      const why = whyNoSpeed();
      if (why) actions.tell('', why, true);
      return why === '';
    });
    return button;
  };
  const simple = (label: string, request: Request, title: string, ask?: string) =>
    actions.button(label, () => request, { name: `${label} ${name}`, title, ask });
  const resets = h(
    'div',
    { class: 'drive-row' },
    simple('Reset drive', { do: 'joint.reset', joint: name }, 'Clears the fault of its drive.'),
  );
  const moves = h(
    'fieldset',
    { class: 'drive' },
    h(
      'div',
      { class: 'drive-row' },
      h('label', {}, `goal [${unit}] `, goal),
      actions.button(
        'Go',
        () => {
          const target = parseGoal(goal.value, unit);
          return whyNot(target) ? null : move(target);
        },
        {
          name: `go to the goal of ${name}`,
          nothing: () => actions.tell('', whyNot(parseGoal(goal.value, unit)), true),
        },
      ),
      slider,
      h('label', {}, `at [${unit}/s] `, speed),
    ),
    h(
      'div',
      { class: 'drive-row' },
      h('span', { class: 'group', role: 'group', 'aria-label': 'steps' }, ...steps),
      h(
        'span',
        { class: 'group', role: 'group', 'aria-label': 'hold to move' },
        hold(-1, '◀ hold'),
        hold(1, 'hold ▶'),
      ),
      simple('Stop', { do: 'joint.stop', joint: name }, 'Its motion brakes.'),
      simple(
        'Idle',
        { do: 'joint.set', joint: name, mode: 'idle' },
        'No torque: it may fall.',
        `${name} gets no torque: it falls where its load takes it.`,
      ),
      simple(
        'Hold',
        { do: 'joint.set', joint: name, mode: 'position' },
        'Position control where it is.',
      ),
      simple('Home', { do: 'joint.home', joint: name }, 'Its drive looks for its place.'),
      simple('Recover', { do: 'joint.recover', joint: name }, 'Leads it back inside its limits.'),
    ),
  );
  return { moves, resets };
}
