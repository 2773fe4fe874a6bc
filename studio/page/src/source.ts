// Where the page's data come from: a run, or a log. The page knows nothing but this.
import type {
  Answer,
  Control,
  Hello,
  Request,
  RunEvent,
  SourceTable,
  Tick,
  TimeBack,
  Window,
} from './protocol';

export type Connection = 'connecting' | 'live' | 'lost' | 'ended' | 'recorded';

export interface Listener {
  connection(state: Connection, words: string): void;
  hello(hello: Hello): void;
  signals(revision: number, sources: SourceTable[]): void;
  tick(tick: Tick): void;
  events(events: RunEvent[]): void;
  back(back: TimeBack): void;
  watched(request: string, answer: Answer): void;
  control(control: Control): void;
  entered(may: string): void;
  trouble(message: string, hint: string): void;
}

export interface Source {
  /** Values come by themselves, and things can be asked: not so of a log. */
  readonly live: boolean;
  on(listener: Partial<Listener>): void;
  /** Text of the robot's description. */
  description(): Promise<string>;
  /** Bytes of a mesh, by the path that the hello has. */
  mesh(path: string): Promise<ArrayBuffer>;
  /** The signals of the next ticks, in this order; the ticks carry the revision. */
  subscribe(revision: number, signals: number[]): void;
  window(signals: number[], from: number, to: number, points: number): Promise<Window>;
  ask(request: Request): Promise<Answer>;
  /** Commands whose answers come again when they change. */
  watch(requests: string[]): void;
  control(take: boolean): void;
  alive(): void;
}
