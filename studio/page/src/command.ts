// The command line that does the same as a request.
import { isRequest, type Request, type RunEvent } from './protocol';

/** A word as a shell takes it. */
export function shellWord(word: string): string {
  return /^[A-Za-z0-9_@%+=:,./-]+$/.test(word) ? word : `'${word.replaceAll("'", "'\\''")}'`;
}

function value(of: unknown): string {
  if (Array.isArray(of)) return `[${of.map(value).join(',')}]`;
  return String(of);
}

function assignments(object: unknown): string[] {
  return Object.entries((object ?? {}) as Record<string, unknown>).map(([name, of]) =>
    shellWord(`${name}=${value(of)}`),
  );
}

function options(request: Request, names: Record<string, string>): string[] {
  return Object.entries(names)
    .filter(([key]) => request[key] !== undefined)
    .map(([key, flag]) => shellWord(`${flag}=${value(request[key])}`));
}

function list(flag: string, names: unknown): string[] {
  return Array.isArray(names) && names.length > 0
    ? [flag, ...names.map((name) => shellWord(String(name)))]
    : [];
}

/** One line for requests that differ in their joint alone. */
export function commandOfAll(requests: Request[]): string {
  const names = requests.map((request) => shellWord(String(request.joint)));
  const lines = requests.map((request) => commandLine({ ...request, joint: '$j' }));
  const line = lines[0]?.replace("'$j'", '"$j"');
  if (lines.some((one) => one !== lines[0])) return requests.map(commandLine).join('; ');
  return `for j in ${names.join(' ')}; do ${line}; done`;
}

export function commandLine(request: Request): string {
  const words = ['tandem', ...request.do.split('.')];
  const joint = shellWord(String(request.joint ?? ''));
  const name = shellWord(String(request.name ?? ''));
  switch (request.do) {
    case 'estop':
      return [...words, ...options(request, { category: '--category' })].join(' ');
    case 'clock.pause':
    case 'clock.resume':
    case 'fault.reset':
    case 'joint.halt':
    case 'joint.tuning':
      return words.join(' ');
    case 'clock.step':
      return [...words, value(request.cycles ?? 1)].join(' ');
    case 'clock.rewind':
      return [...words, `${value(request.by_s)}s`].join(' ');
    case 'clock.goto':
      return [...words, `${value(request.time_s)}s`].join(' ');
    case 'clock.until':
      if (request.cancel === true) return `${words.join(' ')} --cancel`;
      return [...words, shellWord(String(request.condition))].join(' ');
    case 'clock.back-until':
      return [...words, shellWord(String(request.condition))].join(' ');
    case 'clock.rate':
      return [...words, value(request.rate)].join(' ');
    case 'controller.start':
    case 'controller.stop':
    case 'controller.unload':
      return request.name === undefined ? words.join(' ') : [...words, name].join(' ');
    case 'controller.shadow':
      return [...words, name, ...(request.end === true ? ['--end'] : [])].join(' ');
    case 'controller.switch':
      return [
        ...words,
        ...list('--stop', request.stop),
        ...list('--start', request.start),
        ...options(request, { when_within: '--when-within', timeout_s: '--timeout' }),
      ].join(' ');
    case 'controller.set':
      return [...words, name, ...assignments(request.parameters)].join(' ');
    case 'input.set':
      if (request.values) return ['tandem input', name, ...assignments(request.values)].join(' ');
      break;
    case 'joint.stop':
    case 'joint.home':
    case 'joint.recover':
    case 'joint.reset':
      return [...words, joint].join(' ');
    case 'joint.move':
      return [
        ...words,
        joint,
        ...options(request, {
          target_rad: '--to',
          speed_rad_s: '--speed',
          acceleration_rad_s2: '--acceleration',
        }),
      ].join(' ');
    case 'joint.posture':
      return [
        ...words,
        shellWord(String(request.posture)),
        ...list('--joints', request.joints),
        ...options(request, { speed: '--speed' }),
      ].join(' ');
    case 'joint.gains':
      return [
        ...words,
        joint,
        shellWord(String(request.loop)),
        ...options(request, { kp: '--kp', ki: '--ki', kd: '--kd' }),
        ...(request.anyway === true ? ['--anyway'] : []),
      ].join(' ');
    case 'site.move':
      return [
        ...words,
        shellWord(String(request.site)),
        shellWord(String(request.axis)),
        ...options(request, { by: '--by', axes: '--axes', speed: '--speed' }),
      ].join(' ');
    case 'joint.set':
      return [
        ...words,
        joint,
        ...options(request, {
          mode: '--mode',
          interaction: '--interaction',
          stiffness_Nm_rad: '--stiffness',
          damping_Nms_rad: '--damping',
        }),
      ].join(' ');
  }
  return `tandem ask ${shellWord(JSON.stringify(request))}`;
}

const kDone: Record<string, string> = {
  'controller.load': 'loaded',
  'controller.reload': 'loaded anew',
  'controller.start': 'started',
  'controller.stop': 'stopped',
};

/** What a request does, in words: "joint1: gains of its position loop: kd 0.5". */
export function requestInWords(request: Request): string {
  const joint = String(request.joint ?? '');
  const name = String(request.name ?? '');
  const values = (names: string[]) =>
    names.filter((key) => request[key] !== undefined).map((key) => `${key} ${value(request[key])}`);
  switch (request.do) {
    case 'joint.gains':
      return `${joint}: gains of its ${request.loop} loop: ${values(['kp', 'ki', 'kd']).join(', ')}`;
    case 'joint.set': {
      const stiff = { stiffness_Nm_rad: 'stiffness', damping_Nms_rad: 'damping' };
      const impedance = Object.entries(stiff)
        .filter(([key]) => request[key] !== undefined)
        .map(([key, word]) => `${word} ${value(request[key])}`);
      const modes = [request.mode, request.interaction].filter(Boolean).map(String);
      return `${joint}: ${[...modes, ...impedance].join(', ')}`;
    }
    case 'controller.set': {
      const set = Object.entries((request.parameters ?? {}) as Record<string, unknown>);
      return `${name}: ${set.map(([key, of]) => `${key} ${value(of)}`).join(', ')}`;
    }
    case 'controller.switch': {
      const list = (of: unknown) => (Array.isArray(of) ? of.map(String).join(', ') : '');
      const parts = [
        [list(request.stop), 'stopped'],
        [list(request.start), 'started'],
      ];
      return parts
        .filter(([who]) => who !== '')
        .map(([who, what]) => `${who} ${what}`)
        .join('; ');
    }
  }
  const done = kDone[request.do];
  if (done) return `${name || 'controllers'} ${done}`;
  return commandLine(request);
}

function parsedRequest(text: string): Request | null {
  try {
    const request = JSON.parse(text) as Request;
    return typeof request?.do === 'string' ? request : null;
  } catch {
    return null;
  }
}

/** The words of an event "request {…}", and of its refusal behind it; what is none stays as it is. */
export function requestWords(text: string): string {
  const rest = text.replace(/^request /, '');
  for (let end = rest.length; end > 1; end = rest.lastIndexOf('}', end - 2) + 1) {
    const request = parsedRequest(rest.slice(0, end));
    if (request) return requestInWords(request) + rest.slice(end);
  }
  return rest;
}

/** The text of an event: of a request what it does. */
export function eventWords(event: RunEvent): string {
  return isRequest(event) ? `asked: ${requestWords(event.text)}` : event.text;
}
