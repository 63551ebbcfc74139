// A tour by the Tab key: what can be pressed or filled in and is not reached, is reached unseen or lies under
// something else.

const INTERACTIVE =
  'button, input, textarea, select, a[href], summary, [tabindex]:not([tabindex="-1"])';

/** What can be used now, in words; each is given a number. */
const wanted = (page) =>
  page.evaluate((selector) => {
    const modal = document.querySelector('dialog[open]');
    const name = (element) =>
      element.dataset.control ??
      element.getAttribute('aria-label') ??
      (element.textContent.trim().slice(0, 40) || element.id || element.className);
    const found = [...(modal ?? document).querySelectorAll(selector)].filter((element) => {
      const shown = element.checkVisibility({ visibilityProperty: true });
      return (
        shown && !element.disabled && element.tabIndex >= 0 && (modal || !element.closest('dialog'))
      );
    });
    return found.map((element, i) => {
      element.dataset.tour = String(i);
      return `${element.tagName.toLowerCase()} ${name(element)}`;
    });
  }, INTERACTIVE);

/** Where the keyboard is, whether that can be seen, and whether something lies over it. */
const here = (page) =>
  page.evaluate(() => {
    const element = document.activeElement;
    if (!element || element === document.body) return undefined;
    const { outlineStyle, outlineWidth, boxShadow } = getComputedStyle(element);
    const box = element.getBoundingClientRect();
    const x = Math.min(Math.max((box.left + box.right) / 2, 0), innerWidth - 1);
    const y = Math.min(Math.max((box.top + box.bottom) / 2, 0), innerHeight - 1);
    // A pane has others in it; what it is, its corner says.
    const at = document.elementFromPoint(x, y);
    const pane = element.matches('.pane');
    return {
      number: Number(element.dataset.tour ?? -1),
      lit: (outlineStyle !== 'none' && parseFloat(outlineWidth) > 0) || boxShadow !== 'none',
      covered:
        !pane &&
        !(
          at &&
          (element.contains(at) || at.contains(element) || at.closest('label')?.contains(element))
        ),
    };
  });

/** Goes round once; what is wrong, in words. */
export async function tour(page) {
  const names = await wanted(page);
  const seen = new Set();
  const problems = [];
  for (let i = 0; i < 2 * names.length + 10 && seen.size < names.length; ++i) {
    await page.keyboard.press('Tab');
    const at = await here(page);
    if (!at || at.number < 0 || seen.has(at.number)) continue;
    seen.add(at.number);
    if (!at.lit) problems.push(`${names[at.number]} does not show that it has the keyboard`);
    if (at.covered) problems.push(`${names[at.number]} is covered`);
  }
  const missed = names.filter((_, i) => !seen.has(i));
  problems.push(...missed.map((name) => `${name} is not reached`));
  return { count: names.length, problems };
}

/** Tabs to the first element that matches; true if it is there. */
export async function tabTo(page, selector, most = 160) {
  for (let i = 0; i < most; ++i) {
    const there = await page.evaluate(
      (wantedOne) => document.activeElement?.matches(wantedOne) ?? false,
      selector,
    );
    if (there) return true;
    await page.keyboard.press('Tab');
  }
  return false;
}
