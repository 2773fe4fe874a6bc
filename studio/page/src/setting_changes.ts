// What was set during a run, by its events: captures before and after it are not of one kind.
import { requestWords } from './command';
import { isRequest, type RunEvent } from './protocol';

/** Texts of a log's events, and of a run's: commands that change how its joints are led. */
const kOfALog =
  /^(gains set|parameter (set|loaded)|mode or impedance set|controllers switched|controller reloaded|injected|payload)/;
const kRequests =
  /^request .*"do":\s*"(joint\.(gains|set)|controller\.(set|load|reload|start|stop|switch)|inject)/;

/** A change of settings: when, and in words. */
export interface SettingChange {
  time_s: number;
  text: string;
}

/** Captures between two changes. */
export interface CaptureGroup<T> {
  /** What was set before them; null: nothing that is known. */
  change: SettingChange | null;
  captures: T[];
}

/**
 * Captures by the last change before them: their order stays. Those in which something was set
 * behind the trigger are of no setting: `mixed`.
 */
export function groupsOf<
  T extends { trigger: number; first: number; count: number; period_s: number },
>(captures: T[], changes: SettingChange[]): { groups: CaptureGroup<T>[]; mixed: Set<T> } {
  const groups: CaptureGroup<T>[] = [];
  const mixed = new Set<T>();
  for (const capture of captures) {
    const { trigger, first, count, period_s } = capture;
    // What is set at the time of a cycle counts from the next one on.
    const past_s = (first + count - 1.5) * period_s;
    const change = changes.filter((one) => one.time_s <= past_s).at(-1) ?? null;
    if (change && change.time_s > (trigger - 0.5) * period_s) mixed.add(capture);
    const known = groups.find((one) => one.change === change);
    if (known) known.captures.push(capture);
    else groups.push({ change, captures: [capture] });
  }
  return { groups, mixed };
}

/** The changes among events, oldest first. What was refused is none. */
export function settingChanges(events: RunEvent[]): SettingChange[] {
  return events
    .filter(({ level, text }) => kOfALog.test(text) || (level === 'info' && kRequests.test(text)))
    .map((event) => ({
      time_s: event.time_s,
      text: isRequest(event) ? requestWords(event.text) : event.text,
    }))
    .sort((a, b) => a.time_s - b.time_s);
}
