// What a page looks like: on a phone, in the light and in the dark.
import assert from 'node:assert/strict';
import { shot, violations } from './support.mjs';

/** A phone, as an option of openPage(). */
export const kPhone = { width: 390, height: 844, touch: true };
const kDesk = { width: 1400, height: 860 };

/**
 * Names, roles and structure are those of the markup, which is one for all looks: all rules of
 * axe-core judge it in the light. Elsewhere only style sheets differ, so only those rules run again
 * whose verdict they can change.
 * - In the dark: colours.
 * - On a phone: sizes, scrolling, and what is hidden (a hidden heading or label is none). Its
 *   colours are those of the light; of texts that lie over others axe-core gives no verdict.
 */
const kLooks = {
  phone: {
    ...kPhone,
    scheme: 'light',
    rules: [
      'target-size',
      'scrollable-region-focusable',
      'page-has-heading-one',
      'button-name',
      'label',
      'select-name',
    ],
  },
  light: { ...kDesk, scheme: 'light' },
  dark: { ...kDesk, scheme: 'dark', rules: ['color-contrast', 'link-in-text-block'] },
};

/**
 * Nothing for axe-core to find, and nothing wider than the window, whatever tab is open.
 * @param names of looks
 * @param open opens each of the tabs
 * @param of whom, for the names of pictures
 */
export async function looks(page, names, tabs, open, of = 'studio') {
  for (const tab of tabs) {
    await open(tab);
    for (const name of names) {
      const { width, height, scheme, rules } = kLooks[name];
      if (page.viewportSize().width !== width) await page.setViewportSize({ width, height });
      await page.emulateMedia({ colorScheme: scheme });
      await page.waitForFunction(
        ([wide, dark]) =>
          innerWidth === wide && document.documentElement.hasAttribute('data-dark') === dark,
        [width, scheme === 'dark'],
      );
      // What is beside the tabs is the same for all: the rules of a look see it with the first.
      const part = rules && tab !== tabs[0] ? '.panels' : undefined;
      // What a bar of the window hides for a moment comes out by scrolling.
      const found = (await violations(page, rules, part)).filter(
        (one) => !/^target-size: .*partially obscured/s.test(one),
      );
      assert.deepEqual(found, [], `${name}: ${tab}`);
      const wide = await page.evaluate(() => document.documentElement.scrollWidth);
      assert.ok(wide <= width, `${name}: ${tab}: ${wide} of ${width} pixels`);
      await shot(page, `${of}-${name}-${tab}`);
    }
  }
}
