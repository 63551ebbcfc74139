/**
 * Tells whoever measures (a PerformanceObserver for `mark`) when something happened. Nothing is kept: a page
 * that is open for a day would keep millions.
 */
export function trace(name: string, detail?: unknown): void {
  performance.mark(name, { detail });
  performance.clearMarks(name);
}
