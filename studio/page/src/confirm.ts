// Asks once more before a robot moves by more than one joint.
import { h } from './dom';

/** What lives on behind a question: the emergency stop, and what it may have to say. */
const kAlive = '.estop, .fault';

/** Makes the rest of the page inert. @returns what it was not before */
function standStill(within: Element, besides: Element): HTMLElement[] {
  return [...within.children].flatMap((one) => {
    if (one === besides || one.matches(kAlive) || !(one instanceof HTMLElement)) return [];
    if (one.querySelector(kAlive)) return standStill(one, besides);
    if (one.inert) return [];
    one.inert = true;
    return [one];
  });
}

/**
 * A dialog with words and the command; true: the button with `label` was pressed. Until then
 * nothing of the page can be pressed, by pointer or keys, but the emergency stop: a modal dialog
 * would cover that.
 */
export function confirmed(words: string, command: string, label: string): Promise<boolean> {
  const dialog = h('dialog', { class: 'confirm', 'aria-label': label });
  const close = (how: string) => () => dialog.close(how);
  const no = h('button', { type: 'button', onclick: close('no') }, 'Cancel');
  dialog.append(
    h('p', {}, words),
    h('code', { class: 'command', tabindex: '0' }, command),
    h(
      'div',
      { class: 'confirm-row' },
      no,
      h('button', { type: 'button', class: 'go', onclick: close('yes') }, label),
    ),
  );
  const asker = document.activeElement;
  document.body.append(dialog);
  const still = standStill(document.body, dialog);
  const cancel = (event: KeyboardEvent) => {
    if (event.key === 'Escape') dialog.close('no');
  };
  document.addEventListener('keydown', cancel);
  dialog.show();
  no.focus();
  return new Promise((resolve) => {
    dialog.addEventListener('close', () => {
      document.removeEventListener('keydown', cancel);
      for (const one of still) one.inert = false;
      resolve(dialog.returnValue === 'yes');
      dialog.remove();
      if (asker instanceof HTMLElement) asker.focus();
    });
  });
}

/** The run is over: what was to be asked of it is not. */
export function giveUpQuestions(): void {
  for (const open of document.querySelectorAll<HTMLDialogElement>('dialog.confirm')) {
    open.close('no');
  }
}
