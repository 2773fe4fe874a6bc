// Asks once more before a robot moves by more than one joint.
import { h } from './dom';

/**
 * A dialog with words and the command; true: the button with `label` was pressed. The page behind
 * it stays alive: nothing may cover the emergency stop.
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
  document.body.append(dialog);
  for (const other of document.querySelectorAll<HTMLDialogElement>('dialog.confirm[open]')) {
    if (other !== dialog) other.close('no');
  }
  dialog.addEventListener('keydown', (event) => {
    if (event.key === 'Escape') dialog.close('no');
  });
  dialog.show();
  no.focus();
  return new Promise((resolve) => {
    dialog.addEventListener('close', () => {
      resolve(dialog.returnValue === 'yes');
      dialog.remove();
    });
  });
}
