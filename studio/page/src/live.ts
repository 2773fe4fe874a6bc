// The source of a run that goes on: a WebSocket, which is opened again each second when it breaks.
import type { Answer, Hello, Request, RunEvent, SourceTable, TimeBack, Window } from './protocol';
import { decodeTick, decodeWindow, kSubprotocol } from './protocol';
import type { Connection, Listener, Source } from './source';
import { whyRefused } from './versions';

const kAgain_ms = 1000;
/** A question without an answer for so long has none; a change waits a second for the loop. */
const kPatience_ms = 10000;
/** These take as long as the cycles that are played again. */
const kTravels = ['clock.back-until', 'clock.goto', 'clock.rewind'];

interface Pending<T> {
  resolve(value: T): void;
  timer?: ReturnType<typeof setTimeout>;
}

const kNoLink: Answer = {
  ok: false,
  error: 'there is no connection to the run',
  hint: 'it is tried again each second',
};

export class LiveSource implements Source {
  readonly live = true;
  private readonly listeners: Partial<Listener>[] = [];
  private socket: WebSocket | null = null;
  private nextId = 1;
  private readonly asked = new Map<number, Pending<Answer>>();
  private readonly windows = new Map<number, Pending<Window> & { signals: number }>();
  private watching: string[] = [];
  private ended = false;
  private opened = false;
  private refused = ''; // why, as it was said

  /** @param address of the socket: ws://HOST/ws. @param token empty: one may look, and stop. */
  constructor(
    private readonly address: string,
    private readonly token: string,
  ) {}

  on(listener: Partial<Listener>): void {
    this.listeners.push(listener);
  }

  open(): void {
    this.state('connecting', '');
    const socket = new WebSocket(this.address, kSubprotocol);
    socket.binaryType = 'arraybuffer';
    this.socket = socket;
    this.opened = false;
    socket.onopen = () => {
      this.opened = true;
      if (this.token) this.send({ op: 'enter', token: this.token });
      if (this.watching.length > 0) this.send({ op: 'watch', requests: this.watching });
    };
    socket.onmessage = (event) => {
      if (this.socket === socket) this.receive(event.data);
    };
    socket.onclose = (event) => {
      if (this.socket === socket) this.closed(event.code, event.reason);
    };
  }

  async description(): Promise<string> {
    return (await this.get('/robot.urdf')).text();
  }

  async mesh(path: string): Promise<ArrayBuffer> {
    return (await this.get(path)).arrayBuffer();
  }

  private async get(path: string): Promise<Response> {
    const headers = this.token ? { Authorization: `Bearer ${this.token}` } : undefined;
    const answer = await fetch(path, { headers });
    if (!answer.ok) throw new Error(`${path}: ${answer.status} ${await answer.text()}`);
    return answer;
  }

  subscribe(revision: number, signals: number[]): void {
    this.send({ op: 'subscribe', revision, signals });
  }

  window(signals: number[], from: number, to: number, points: number): Promise<Window> {
    const id = this.nextId++;
    const none: Window = {
      id,
      level: 0,
      rows: 0,
      cyclesPerRow: 1,
      start: from,
      step: 0,
      min: signals.map(() => new Float32Array()),
      max: signals.map(() => new Float32Array()),
    };
    if (!this.send({ op: 'window', id, signals, from_s: from, to_s: to, points })) {
      return Promise.resolve(none);
    }
    return new Promise((resolve) => {
      const timer = setTimeout(() => {
        this.windows.delete(id);
        resolve(none);
      }, kPatience_ms);
      this.windows.set(id, { resolve, timer, signals: signals.length });
    });
  }

  ask(request: Request): Promise<Answer> {
    const id = this.nextId++;
    if (!this.send({ op: 'ask', id, request })) return Promise.resolve(kNoLink);
    return new Promise((resolve) => {
      const giveUp = () => {
        this.asked.delete(id);
        resolve({
          ok: false,
          error: `no answer within ${kPatience_ms / 1000} s`,
          hint: 'the run may be busy: look at its state before you ask again',
        });
      };
      const patient = kTravels.includes(request.do);
      const timer = patient ? undefined : setTimeout(giveUp, kPatience_ms);
      this.asked.set(id, { resolve, timer });
    });
  }

  watch(requests: string[]): void {
    this.watching = requests;
    this.send({ op: 'watch', requests });
  }

  control(take: boolean): void {
    this.send({ op: 'control', take });
  }

  alive(): void {
    this.send({ op: 'alive' });
  }

  private send(message: object): boolean {
    if (this.socket?.readyState !== WebSocket.OPEN) return false;
    this.socket.send(JSON.stringify(message));
    return true;
  }

  private each(call: (listener: Partial<Listener>) => void): void {
    for (const listener of this.listeners) call(listener);
  }

  private state(state: Connection, words: string): void {
    this.each((l) => l.connection?.(state, words));
  }

  private closed(code: number, reason: string): void {
    this.socket = null;
    for (const one of this.asked.values()) {
      clearTimeout(one.timer);
      one.resolve({ ...kNoLink, error: 'the connection broke before the answer came' });
    }
    this.asked.clear();
    for (const [id, one] of this.windows) {
      clearTimeout(one.timer);
      const none = Array.from({ length: one.signals }, () => new Float32Array());
      one.resolve({
        id,
        level: 0,
        rows: 0,
        cyclesPerRow: 1,
        start: 0,
        step: 0,
        min: none,
        max: none,
      });
    }
    this.windows.clear();
    this.each((l) => l.control?.({ taken: false, yours: false, by: '' }));
    if (this.ended) return;
    this.state('lost', reason || (code === 1006 ? '' : `code ${code}`));
    if (!this.opened) void this.sayWhyRefused();
    setTimeout(() => this.open(), kAgain_ms);
  }

  private async sayWhyRefused(): Promise<void> {
    try {
      const answer = await fetch(this.address.replace(/^ws/, 'http'));
      const words = whyRefused(answer.status, await answer.text());
      if (words && words !== this.refused) this.each((l) => l.trouble?.(words, ''));
      this.refused = words;
    } catch {
      // Nobody is there.
    }
  }

  private receive(data: unknown): void {
    try {
      if (data instanceof ArrayBuffer) this.binary(data);
      else if (typeof data === 'string') this.text(JSON.parse(data));
    } catch (error) {
      this.each((l) =>
        l.trouble?.(`a frame cannot be read: ${error}`, 'is the page as new as the run?'),
      );
    }
  }

  private binary(data: ArrayBuffer): void {
    const kind = data.byteLength > 0 ? new Uint8Array(data)[0] : 0;
    if (kind === 1) {
      const tick = decodeTick(data);
      this.each((l) => l.tick?.(tick));
    } else if (kind === 2) {
      const window = decodeWindow(data);
      const pending = this.windows.get(window.id);
      this.windows.delete(window.id);
      if (pending) clearTimeout(pending.timer);
      pending?.resolve(window);
    }
  }

  private text(message: { op?: string; [key: string]: unknown }): void {
    switch (message.op) {
      case 'hello':
        this.state('live', '');
        this.each((l) => l.hello?.(message as unknown as Hello));
        return;
      case 'signals':
        this.each((l) => l.signals?.(message.revision as number, message.sources as SourceTable[]));
        return;
      case 'events':
        this.each((l) => l.events?.(message.events as RunEvent[]));
        return;
      case 'back':
        this.each((l) => l.back?.(message as unknown as TimeBack));
        return;
      case 'watched':
        this.each((l) => l.watched?.(message.request as string, message.answer as Answer));
        return;
      case 'control':
        this.each((l) =>
          l.control?.({
            taken: message.taken === true,
            yours: message.yours === true,
            by: String(message.by ?? ''),
            wentBack: message.went_back === true,
          }),
        );
        return;
      case 'entered':
        this.each((l) => l.entered?.(String(message.may)));
        return;
      case 'answer': {
        const pending = this.asked.get(message.id as number);
        this.asked.delete(message.id as number);
        if (pending) clearTimeout(pending.timer);
        pending?.resolve(message.answer as Answer);
        return;
      }
      case 'error':
        this.each((l) => l.trouble?.(String(message.message ?? ''), String(message.hint ?? '')));
        return;
      case 'ended': {
        this.ended = true;
        const log = message.log ? `; its log: ${message.log}` : '';
        this.state('ended', `${message.how ?? ''}${log}`);
        return;
      }
    }
  }
}
