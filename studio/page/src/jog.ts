// Hold-to-move: while a button is held, the joint gets goals a little ahead; at release it stops.
import type { Answer, Request } from './protocol';

const kAgain_ms = 200;
/** A goal is so far ahead: what the joint still goes when the page is lost. */
export const kAhead_s = 0.5;

export interface JogJoint {
  name: string;
  lower: number | null;
  upper: number | null;
  position(): number;
  /** NaN: nobody has said one, and it does not move. */
  speed(): number;
}

/** Goals as long as something is held, and a stop in any case. */
export class Held {
  private direction = 0;
  private timer: ReturnType<typeof setTimeout> | null = null;

  /**
   * @param goal the request that comes next; null: there is none yet.
   * @param stopper the request that stops it.
   */
  constructor(
    private readonly ask: (request: Request) => Promise<Answer>,
    readonly goal: (direction: number) => Request | null,
    private readonly stopper: Request,
    private readonly said: (request: Request, answer: Answer) => void = () => {},
  ) {}

  get moving(): boolean {
    return this.direction !== 0;
  }

  start(direction: 1 | -1): void {
    if (this.direction !== 0) return;
    this.direction = direction;
    void this.again();
  }

  /** Stops in any case; once more when a goal was still under way and may come after the stop. */
  stop(): void {
    if (this.direction === 0) return;
    this.direction = 0;
    if (this.timer) clearTimeout(this.timer);
    this.timer = null;
    void this.halt();
  }

  private async halt(): Promise<void> {
    this.said(this.stopper, await this.ask(this.stopper));
  }

  private async again(): Promise<void> {
    const request = this.direction === 0 ? null : this.goal(this.direction);
    if (!request) return;
    const answer = await this.ask(request);
    this.said(request, answer);
    if (this.direction === 0) return this.halt();
    if (!answer.ok) {
      this.direction = 0;
      return;
    }
    this.timer = setTimeout(() => void this.again(), kAgain_ms);
  }
}

/** Of one joint. */
export class Jog extends Held {
  constructor(
    ask: (request: Request) => Promise<Answer>,
    joint: JogJoint,
    said: (request: Request, answer: Answer) => void = () => {},
  ) {
    super(
      ask,
      (direction) => goalOf(joint, direction),
      { do: 'joint.stop', joint: joint.name },
      said,
    );
  }
}

/** A goal a little ahead, inside the limits. */
function goalOf(joint: JogJoint, direction: number): Request | null {
  const { name, lower, upper } = joint;
  const speed = joint.speed();
  if (!Number.isFinite(joint.position()) || !(speed > 0)) return null;
  const ahead = joint.position() + direction * speed * kAhead_s;
  const target = Math.min(
    upper ?? Number.POSITIVE_INFINITY,
    Math.max(lower ?? Number.NEGATIVE_INFINITY, ahead),
  );
  return { do: 'joint.move', joint: name, target_rad: target, speed_rad_s: speed };
}

/**
 * A button that moves as long as it is held: pointer, or blank and Enter.
 * @param may whether it moves now; says why not
 */
export function holdToMove(
  button: HTMLButtonElement,
  jog: Held,
  direction: 1 | -1,
  may: () => boolean = () => true,
): void {
  const stop = () => {
    jog.stop();
    button.classList.remove('held');
  };
  const start = () => {
    if (button.disabled || !may()) return;
    button.classList.add('held');
    jog.start(direction);
  };
  button.addEventListener('pointerdown', (event) => {
    if (event.button !== 0) return;
    button.setPointerCapture(event.pointerId);
    start();
  });
  for (const name of ['pointerup', 'pointercancel', 'lostpointercapture', 'blur', 'contextmenu']) {
    button.addEventListener(name, stop);
  }
  button.addEventListener('keydown', (event) => {
    if (event.key !== ' ' && event.key !== 'Enter') return;
    event.preventDefault();
    if (!event.repeat) start();
  });
  button.addEventListener('keyup', stop);
  document.addEventListener('visibilitychange', stop);
  window.addEventListener('pagehide', stop);
}
