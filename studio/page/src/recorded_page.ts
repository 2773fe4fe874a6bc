// The page of a recording: the parts that need no run.
import { Actions } from './actions';
import { ControlLease } from './control';
import { Data } from './data';
import { h } from './dom';
import { Events } from './events';
import { Header } from './header';
import { Joints } from './joints';
import { whenPrinted } from './paper';
import { Playback } from './playback';
import { Plots } from './plots';
import { RecordedSource, type Recording, recordingIn } from './recorded';
import { Report } from './report';
import { Scene } from './scene';
import { Scope } from './scope';
import { servedDocument, servedWindow } from './served';
import type { Source } from './source';
import { Tabs } from './tabs';

type ThemeButton = (changed: () => void) => HTMLElement;

/** The page of `tandem studio LOG`: the recording comes from there, with its token. */
export async function startServed(
  path: string,
  token: string,
  themeButton: ThemeButton,
): Promise<void> {
  try {
    const served = await servedDocument(path, token);
    const recording = recordingIn(served);
    const article = served.getElementById('report');
    if (!recording || !article) throw new Error(`${path} is no recording`);
    document.body.append(document.adoptNode(article));
    startRecorded(recording, themeButton, (...asked) => servedWindow(token, ...asked));
  } catch (error) {
    const words = error instanceof Error ? error.message : String(error);
    document.body.append(
      h('p', { class: 'fault', role: 'alert' }, `The log is not here: ${words}`),
    );
  }
}

/** @param themeButton makes the button that changes the colours. @param finer as RecordedSource's */
export function startRecorded(
  recording: Recording,
  themeButton: ThemeButton,
  finer: Source['window'] | null = null,
): void {
  document.body.classList.add('recorded');
  const source = new RecordedSource(recording, finer);
  const data = new Data(source);
  const actions = new Actions(source);
  actions.tell('', 'A recording: nothing here acts on a robot.');
  const scene = new Scene(data);
  const plots = new Plots(data, (words, bad) => actions.tell('', words, bad));
  const scope = new Scope(
    data,
    (words, bad) => actions.tell('', words, bad),
    () => plots.keep(),
  );
  plots.scope = scope;
  const joints = new Joints(data, actions, new ControlLease(source));
  const playback = new Playback(data, source);
  const article = document.getElementById('report') ?? h('article', { class: 'report' });
  const report = new Report(data, recording, article);
  const header = new Header(
    data,
    actions,
    themeButton(() => {
      scene.themeChanged();
      plots.themeChanged();
      report.themeChanged();
      scope.themeChanged();
    }),
  );
  const tabs = new Tabs(
    [
      { name: 'report', label: 'Report', content: article },
      { name: 'plots', label: 'Plots', content: plots.element },
      // It takes every cycle.
      ...(finer || recording.grid.cycles === 1
        ? [{ name: 'scope', label: 'Scope', content: scope.element }]
        : []),
      { name: 'joints', label: 'Joints', content: joints.element },
      { name: 'events', label: 'Events', content: new Events(data).element },
    ],
    (name) => joints.want(name === 'joints'),
  );
  scene.whenTree((tree) => joints.setTree(tree));
  source.on({
    trouble: (message, hint) => actions.tell('', `${message}${hint ? ` – ${hint}` : ''}`, true),
  });
  document.body.append(
    header.element,
    h(
      'main',
      { class: 'main' },
      h('div', { class: 'side' }, scene.element, playback.element),
      tabs.element,
    ),
    actions.bar,
  );
  tabs.open('report');
  scene.themeChanged();
  // On paper the report alone is seen.
  whenPrinted(() => {
    tabs.open('report');
    report.drawAnew();
  });
  void source.open();
  let fresh = false;
  data.whenTick(() => {
    fresh = true;
  });
  const frame = (now: number) => {
    playback.update(now);
    if (fresh) {
      header.update();
      if (tabs.active === 'joints') joints.update();
      fresh = false;
    }
    scene.update(now);
    if (tabs.active === 'plots') plots.update(now);
    if (tabs.active === 'report') report.update();
    if (tabs.active === 'scope') scope.update(now);
    requestAnimationFrame(frame);
  };
  requestAnimationFrame(frame);
}
