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
  speed(): number;
}

export class Jog {
  private direction = 0;
  private timer: ReturnType<typeof setTimeout> | null = null;

  constructor(
    private readonly ask: (request: Request) => Promise<Answer>,
    private readonly joint: JogJoint,
    private readonly said: (request: Request, answer: Answer) => void = () => {},
  ) {}

  get moving(): boolean {
    return this.direction !== 0;
  }

  /** The goal that the next message has. */
  goal(direction: number): Request {
    const { name, lower, upper } = this.joint;
    const speed = this.joint.speed();
    const ahead = this.joint.position() + direction * speed * kAhead_s;
    const target = Math.min(
      upper ?? Number.POSITIVE_INFINITY,
      Math.max(lower ?? Number.NEGATIVE_INFINITY, ahead),
    );
    return { do: 'joint.move', joint: name, target_rad: target, speed_rad_s: speed };
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
    const request = { do: 'joint.stop', joint: this.joint.name };
    this.said(request, await this.ask(request));
  }

  private async again(): Promise<void> {
    if (this.direction === 0 || !Number.isFinite(this.joint.position())) return;
    const request = this.goal(this.direction);
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

/** A button that moves as long as it is held: pointer, or blank and Enter. */
export function holdToMove(button: HTMLButtonElement, jog: Jog, direction: 1 | -1): void {
  const stop = () => {
    jog.stop();
    button.classList.remove('held');
  };
  const start = () => {
    if (button.disabled) return;
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
