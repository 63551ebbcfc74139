import { createRequire } from 'node:module';
import { readFileSync } from 'node:fs';

const RULES = ['wcag2a', 'wcag2aa', 'wcag21a', 'wcag21aa', 'wcag22aa'];
const axe = readFileSync(createRequire(import.meta.url).resolve('axe-core/axe.min.js'), 'utf8');

/** What axe-core holds against the page (WCAG 2.2 AA), and where. */
export async function barriers(page) {
  const violations = await page.evaluate(
    async ([source, values]) => {
      if (!window.axe) new Function(source)();
      const found = await window.axe.run(document, { runOnly: { type: 'tag', values } });
      return found.violations.map(({ id, nodes }) => [
        id,
        nodes.map(({ target }) => target.join(' ')),
      ]);
    },
    [axe, RULES],
  );
  return violations.map(([id, where]) => `${id} at ${where.slice(0, 3).join(', ')}`);
}
