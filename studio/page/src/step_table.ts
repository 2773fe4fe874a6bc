// The table of step responses: a row for each capture, then mean and spread of each setting.
import { h } from './dom';
import { digits, duration, fixed, seconds } from './format';
import type { Capture } from './scope_engine';
import { groupsOf, type SettingChange } from './setting_changes';
import { type StepFigures, spreadOf, stepFigures } from './step_response';

interface Column {
  head: string;
  title: string;
  of(figures: StepFigures): number;
  text(value: number): string;
  /** What stands there when there is no such figure. */
  none: string;
  /** Steps up and down have no common mean. */
  alone?: boolean;
}

const number = (value: number) => digits(value, 4);
const percent = (value: number) => `${fixed(100 * value, 1)} %`;

const kColumns: Column[] = [
  {
    head: 'step',
    title: 'change of the response',
    of: (one) => one.change,
    text: number,
    none: '–',
    alone: true,
  },
  {
    head: 'rise time',
    title: 'from 10 % to 90 % of the change',
    of: (one) => one.rise_s,
    text: duration,
    none: '–',
  },
  {
    head: 'overshoot',
    title: 'beyond the final value, as a share of the change',
    of: (one) => one.overshoot,
    text: percent,
    none: '–',
  },
  {
    head: 'peak time',
    title: 'from the step to the largest value',
    of: (one) => one.peak_s,
    text: duration,
    none: 'no peak',
  },
  {
    head: 'settles to 5 %',
    title: 'since when it stays within 5 % of the change about the final value',
    of: (one) => one.settling5_s,
    text: duration,
    none: 'not settled',
  },
  {
    head: 'to 2 %',
    title: 'since when it stays within 2 % of the change about the final value',
    of: (one) => one.settling2_s,
    text: duration,
    none: 'not settled',
  },
  {
    head: 'error',
    title: 'steady-state error: reference less final value',
    of: (one) => one.error,
    text: number,
    none: 'no reference',
  },
];

/** Figures of a capture's channel. @param reference empty: none */
export function figuresOf(capture: Capture, response: string, reference: string): StepFigures {
  return stepFigures({
    step_s: capture.period_s,
    trigger: capture.trigger - capture.first,
    response: capture.channels.get(response) ?? [],
    reference: reference ? (capture.channels.get(reference) ?? []) : null,
  });
}

const kMixed = 'something was set behind its trigger: it counts for no mean';

/**
 * A row for each capture; mean and spread are of those between two changes of settings.
 * @param captures newest first  @param unit of the response
 */
export function stepTable(
  captures: Capture[],
  response: string,
  reference: string,
  unit: string,
  changes: SettingChange[] = [],
): HTMLElement {
  const { groups, mixed } = groupsOf(captures, changes);
  const cell = (text: string, data?: number) =>
    h('td', { class: 'figure', 'data-value': Number.isFinite(data) ? String(data) : null }, text);
  const row = (capture: Capture, figures: StepFigures) => {
    const words = mixed.has(capture) ? kMixed : figures.words;
    return h(
      'tr',
      {},
      h('th', { scope: 'row' }, seconds(capture.trigger * capture.period_s)),
      ...(words
        ? [h('td', { colspan: kColumns.length, class: 'no-figures' }, words)]
        : kColumns.map(({ of, text, none }) => {
            const value = of(figures);
            return cell(Number.isFinite(value) ? text(value) : none, value);
          })),
    );
  };
  const summary = (head: string, of: (column: Column) => number) =>
    h(
      'tr',
      { class: 'summary' },
      h('th', { scope: 'row' }, head),
      ...kColumns.map((column) => {
        const value = column.alone ? Number.NaN : of(column);
        return cell(Number.isFinite(value) ? column.text(value) : '–', value);
      }),
    );
  const bodies = groups.map(({ change, captures: own }) => {
    const known = own.map((capture) => figuresOf(capture, response, reference));
    const counted = known.filter((_, i) => !mixed.has(own[i]));
    const head = change ? `since ${seconds(change.time_s)}: ${change.text}` : 'before';
    return h(
      'tbody',
      {},
      groups.length > 1
        ? h(
            'tr',
            { class: 'step-group' },
            h('th', { scope: 'rowgroup', colspan: kColumns.length + 1 }, head),
          )
        : null,
      ...own.map((capture, i) => row(capture, known[i])),
      summary('mean', ({ of }) => spreadOf(counted.map(of)).mean),
      summary('spread', ({ of }) => spreadOf(counted.map(of)).spread),
    );
  });
  return h(
    'table',
    { class: 'step-table' },
    h(
      'thead',
      {},
      h(
        'tr',
        {},
        h('th', { scope: 'col' }, 'trigger at'),
        ...kColumns.map(({ head, title, text }) =>
          h('th', { scope: 'col', title }, text === number && unit ? `${head} [${unit}]` : head),
        ),
      ),
    ),
    ...bodies,
  );
}
