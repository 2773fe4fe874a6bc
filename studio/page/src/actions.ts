// Buttons that ask the run for something, and the line that says what became of it.
import { commandLine, commandOfAll } from './command';
import { confirmed, giveUpQuestions } from './confirm';
import { h, say } from './dom';
import { seconds } from './format';
import type { Answer, Request } from './protocol';
import type { Source } from './source';

export interface ButtonOptions {
  class?: string;
  /** What a screen reader says where the label is a sign. */
  name?: string;
  title?: string;
  /** Without the button that copies the command line. */
  bare?: boolean;
  /** What is asked once more before, in a dialog with the command. */
  ask?: string | (() => string);
  done?(answer: Answer, asked: Request): void;
  /** It was pressed, and there is nothing to ask for. */
  nothing?(): void;
}

export async function copyText(text: string): Promise<boolean> {
  try {
    await navigator.clipboard.writeText(text);
    return true;
  } catch {
    return false;
  }
}

/** What may take long, in words. */
const kUnderWay: Record<string, string> = {
  'clock.back-until': 'searching backwards… The emergency stop ends it. ',
};

/** Controls that ask the run: those of the class, and all within an element of it. */
const kAsking = ':is(button, input, select, fieldset):is(.asks-run, .asks-run *)';
/** What is bad is red for so long, or until the next action. */
const kRed_ms = 10_000;

/** Why something was refused. */
function wordsOf(answer: Answer): string {
  return `${answer.error ?? 'refused'}${answer.hint ? ` – ${answer.hint}` : ''}`;
}

const kEnded = 'The run has ended: nothing can be asked of it any more.';

/** Of a run that is over: why it cannot be pressed stands where its command was. */
function closeAll(): void {
  for (const control of document.querySelectorAll<HTMLButtonElement>(kAsking)) {
    control.title = kEnded;
    if (!control.disabled) control.disabled = true;
  }
}

export class Actions {
  private ended = false;
  /** Of the run; NaN: nobody has told it. */
  private now = Number.NaN;
  private cooling: ReturnType<typeof setTimeout> | undefined;
  /** When what the words are about was. */
  private readonly when = h('span', { class: 'muted' });
  private readonly words = h('span', { class: 'said', role: 'status', 'aria-live': 'polite' });
  private readonly line = h('code', { class: 'command', tabindex: '0' });
  private readonly copier = h(
    'button',
    { type: 'button', class: 'copy', onclick: () => void this.copy(this.line.textContent ?? '') },
    'copy',
  );
  /** Beside the words, which a screen reader would say again at each second. */
  private readonly elapsed = h('span');
  private readonly underWay = new Map<Request, number>();
  readonly bar = h(
    'footer',
    { class: 'said-bar', 'aria-label': 'last action' },
    this.line,
    this.copier,
    h('span', {}, this.when, this.words, this.elapsed),
  );

  constructor(readonly source: Source) {
    this.line.hidden = true;
    this.copier.hidden = true;
    const hovers = matchMedia('(hover: hover)').matches;
    say(
      this.words,
      hovers
        ? 'Point at a button to see its command.'
        : 'What you press is shown here as a command.',
    );
    source.on({
      connection: (state, words) => {
        if (state !== 'ended') return;
        this.ended = true;
        closeAll();
        giveUpQuestions();
        // What is made, or would be enabled, from now on.
        const changes = { subtree: true, childList: true, attributeFilter: ['disabled'] };
        new MutationObserver(closeAll).observe(document.body, changes);
        this.tell('', words ? `${kEnded} It ended: ${words}` : kEnded);
      },
      tick: ({ time }) => {
        if (source.live) this.now = time;
      },
    });
  }

  /** Shows a command and words about it, with the time of the run. */
  tell(command: string, words: string, bad = false): void {
    this.line.hidden = command === '';
    this.copier.hidden = command === '';
    say(this.line, command);
    say(this.when, Number.isFinite(this.now) ? `at ${seconds(this.now)}: ` : '');
    say(this.words, words);
    this.elapsed.hidden = !Object.values(kUnderWay).includes(words);
    this.bar.classList.toggle('bad', bad);
    clearTimeout(this.cooling);
    if (bad) this.cooling = setTimeout(() => this.bar.classList.remove('bad'), kRed_ms);
  }

  async run(request: Request): Promise<Answer> {
    const words = kUnderWay[request.do];
    this.tell(commandLine(request), words ?? '…');
    if (words) this.underWay.set(request, performance.now());
    const ticking = words ? setInterval(() => this.count(), 200) : undefined;
    this.count();
    const answer = await this.source.ask(request);
    clearInterval(ticking);
    this.underWay.delete(request);
    this.count();
    this.show(request, answer);
    return answer;
  }

  /** Whether a search of this page is under way: the run stands meanwhile. */
  get searching(): boolean {
    return this.underWay.size > 0;
  }

  private count(): void {
    const [since] = this.underWay.values();
    say(
      this.elapsed,
      since === undefined ? '' : `${Math.floor((performance.now() - since) / 1000)} s`,
    );
  }

  /** What became of a request. */
  show(request: Request, answer: Answer): void {
    const command = commandLine(request);
    if (answer.ok) {
      const note = typeof answer.note === 'string' ? `: ${answer.note}` : '';
      this.tell(
        command,
        `${answer.done === false ? 'not yet' : answer.waits ? 'it waits' : 'done'}${note}`,
      );
    } else {
      this.tell(command, wordsOf(answer), true);
    }
  }

  /** Asks one after the other, in spite of refusals; the words are about all of them. */
  async runAll(requests: Request[]): Promise<Answer[]> {
    if (requests.length === 1) return [await this.run(requests[0])];
    const command = commandOfAll(requests);
    const answers: Answer[] = [];
    for (const request of requests) {
      this.tell(command, `${answers.length} of ${requests.length} …`);
      answers.push(await this.source.ask(request));
    }
    const refused = answers.filter((answer) => !answer.ok);
    const done = `${answers.length - refused.length} of ${answers.length} done`;
    const why = refused.length > 0 ? `; ${wordsOf(refused[0])}` : '';
    this.tell(command, done + why, refused.length > 0);
    return answers;
  }

  async copy(command: string): Promise<void> {
    const copied = await copyText(command);
    this.tell(
      command,
      copied ? 'copied' : 'the browser does not let the page copy: select the text',
    );
  }

  /** A button with the command that does the same as its title, and a small one that copies it. */
  button(label: string, request: () => Request | null, options: ButtonOptions = {}): HTMLElement {
    const button = h(
      'button',
      {
        type: 'button',
        class: ['asks-run', options.class].filter(Boolean).join(' '),
        'aria-label': options.name,
        onclick: async () => {
          const asked = request();
          if (!asked) return options.nothing?.();
          const ask = typeof options.ask === 'function' ? options.ask() : options.ask;
          if (ask && !(await confirmed(ask, commandLine(asked), label))) return;
          const answer = await this.run(asked);
          options.done?.(answer, asked);
        },
      },
      label,
    );
    const describe = () => {
      if (this.ended) return;
      const asked = request();
      button.title = [options.title, asked && commandLine(asked)].filter(Boolean).join('\n');
    };
    button.addEventListener('pointerenter', describe);
    button.addEventListener('focus', describe);
    describe();
    if (options.bare) return button;
    const copier = h('button', {
      type: 'button',
      class: 'copy asks-run',
      title: 'copy the command',
      'aria-label': `copy the command of ${options.name ?? label}`,
      onclick: () => {
        const asked = request();
        if (asked) void this.copy(commandLine(asked));
      },
    });
    return h('span', { class: 'action' }, button, copier);
  }
}
