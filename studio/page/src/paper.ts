// A page that is printed: light colours, and plots as wide as a sheet.

const kClass = 'paper';

/** Whether the page is being printed. */
export function onPaper(): boolean {
  return document.body.classList.contains(kClass);
}

/** @param changed  draws anew what the colours and the width are of: before printing, and behind it */
export function whenPrinted(changed: () => void): void {
  let dark = false;
  const turn = (paper: boolean) => {
    if (paper === onPaper()) return;
    const root = document.documentElement;
    if (paper) dark = root.hasAttribute('data-dark');
    root.toggleAttribute('data-dark', !paper && dark);
    document.body.classList.toggle(kClass, paper);
    changed();
  };
  addEventListener('beforeprint', () => turn(true));
  addEventListener('afterprint', () => turn(false));
}
