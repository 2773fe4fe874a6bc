// The page: joins its parts with the run that serves it, or with the recording that it holds.
import 'uplot/dist/uPlot.min.css';
import './theme.css';
import './style.css';
import './panels.css';
import './past.css';
import './joints.css';
import './scene.css';
import './scope.css';
import './loop.css';
import './expected.css';
import './report.css';
import './emulation.css';
import './narrow.css';
import { Actions } from './actions';
import { ClockPanel } from './clock';
import { ControlLease } from './control';
import { Controllers } from './controllers';
import { Data } from './data';
import { h, say } from './dom';
import { EmulationPanel, kEmulationTabs } from './emulation';
import { Events } from './events';
import { Expectations } from './expectations';
import { Header } from './header';
import { Inputs } from './inputs';
import { Joints } from './joints';
import { LiveSource } from './live';
import { LoopPanel } from './loop';
import { Plots } from './plots';
import { recordingIn } from './recorded';
import { startRecorded, startServed } from './recorded_page';
import { Scene } from './scene';
import { Scope } from './scope';
import { Tabs } from './tabs';
import { misfit } from './versions';

/** build.mjs puts it here. */
declare const PAGE_VERSION: string;

const kAlways = ['status', 'clock.show', 'fault.show'];
const kWatched: Record<string, string[]> = {
  plots: [],
  scope: [],
  joints: ['joint.list'],
  controllers: ['controller.show', 'controller.difference'],
  inputs: ['input.list'],
  loop: ['loop.show'],
  expected: ['expect.show'],
  events: [],
};
const kThemes = ['auto', 'light', 'dark'];
const kThemeKey = 'tandem.studio.theme';

function stored(key: string): string | null {
  try {
    return localStorage.getItem(key);
  } catch {
    return null;
  }
}

function themeButton(changed: () => void): HTMLElement {
  const button = h('button', { type: 'button', class: 'quiet theme' });
  const system = matchMedia('(prefers-color-scheme: dark)');
  let theme = stored(kThemeKey) ?? 'auto';
  const show = () => {
    const dark = theme === 'auto' ? system.matches : theme === 'dark';
    document.documentElement.toggleAttribute('data-dark', dark);
    say(button, theme === 'auto' ? '◐ auto' : theme === 'light' ? '○ light' : '● dark');
    button.title = 'light, dark, or as the system says';
    changed();
  };
  button.addEventListener('click', () => {
    theme = kThemes[(kThemes.indexOf(theme) + 1) % kThemes.length];
    try {
      localStorage.setItem(kThemeKey, theme);
    } catch {
      // Not kept: the next page follows the system.
    }
    show();
  });
  system.addEventListener('change', show);
  show();
  return button;
}

/** What stands behind `#token=` in an address. */
function tokenOf(hash: string): string {
  return /(?:^#|&)token=([0-9a-f]+)/.exec(hash)?.[1] ?? '';
}

function start(): void {
  const token = tokenOf(location.hash);
  const scheme = location.protocol === 'https:' ? 'wss' : 'ws';
  const source = new LiveSource(`${scheme}://${location.host}/ws`, token);
  const data = new Data(source);
  const actions = new Actions(source);
  const lease = new ControlLease(source);
  const scene = new Scene(data);
  const plots = new Plots(data, (words, bad) => actions.tell('', words, bad));
  const scope = new Scope(
    data,
    (words, bad) => actions.tell('', words, bad),
    () => plots.keep(),
  );
  plots.scope = scope;
  const joints = new Joints(data, actions, lease);
  const header = new Header(
    data,
    actions,
    themeButton(() => {
      scene.themeChanged();
      plots.themeChanged();
      scope.themeChanged();
    }),
  );
  const emulation = new EmulationPanel(data);
  // Nothing is asked before it is known whether there is somebody to ask.
  const watch = (tab: string) => {
    if (data.hello && !data.hello.emulated) source.watch([...kAlways, ...(kWatched[tab] ?? [])]);
  };
  const tabs = new Tabs(
    [
      { name: 'plots', label: 'Plots', content: plots.element },
      { name: 'scope', label: 'Scope', content: scope.element },
      { name: 'joints', label: 'Joints', content: joints.element },
      {
        name: 'controllers',
        label: 'Controllers',
        content: new Controllers(data, actions, lease).element,
      },
      { name: 'inputs', label: 'Inputs', content: new Inputs(data, actions).element },
      { name: 'loop', label: 'Loop', content: new LoopPanel(data).element },
      { name: 'expected', label: 'Expected', content: new Expectations(data).element },
      { name: 'events', label: 'Events', content: new Events(data).element },
    ],
    (name) => {
      watch(name);
      joints.want(name === 'joints');
    },
  );
  scene.whenTree((tree) => joints.setTree(tree));
  source.on({
    trouble: (message, hint) => actions.tell('', `${message}${hint ? ` – ${hint}` : ''}`, true),
  });
  data.whenHello((hello) => {
    if (hello.emulated) actions.tell('', 'Faults are injected by command: tandem inject');
    tabs.keep(hello.emulated ? kEmulationTabs : Object.keys(kWatched));
    watch(tabs.active);
    const words = misfit(hello, PAGE_VERSION);
    if (words) actions.tell('', words, true);
  });
  document.body.append(
    header.element,
    h(
      'main',
      { class: 'main' },
      h(
        'div',
        { class: 'side' },
        scene.element,
        new ClockPanel(data, actions, lease).element,
        emulation.element,
      ),
      tabs.element,
    ),
    actions.bar,
  );
  tabs.open('plots');
  scene.themeChanged();
  source.open();
  let fresh = false;
  data.whenTick(() => {
    fresh = true;
  });
  const frame = (now: number) => {
    if (fresh) {
      header.update();
      emulation.update();
      if (tabs.active === 'joints') joints.update();
      fresh = false;
    }
    scene.update(now);
    if (tabs.active === 'plots') plots.update(now);
    if (tabs.active === 'scope') scope.update(now);
    requestAnimationFrame(frame);
  };
  requestAnimationFrame(frame);
}

const recording = recordingIn(document);
const log = document.body.dataset.log;
if (log) void startServed(log, tokenOf(location.hash), themeButton);
else if (recording) startRecorded(recording, themeButton);
else start();
