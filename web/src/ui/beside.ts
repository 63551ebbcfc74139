const GAP_PX = 6;

/**
 * Puts words beside their button, within the window: to its right, or above it where buttons lie in a
 * row. For `position: fixed`: what holds the buttons may scroll, and would cut them off.
 */
export function beside(words: HTMLElement, button: HTMLElement): void {
  const box = button.getBoundingClientRect();
  const { width, height } = words.getBoundingClientRect();
  const row = button.closest('nav');
  const lying = row !== null && row.clientWidth > row.clientHeight;
  const left = lying ? box.left : box.right + GAP_PX;
  const top = lying ? box.top - height - GAP_PX : box.top;
  const most = {
    left: window.innerWidth - width - GAP_PX,
    top: window.innerHeight - height - GAP_PX,
  };
  words.style.left = `${Math.max(GAP_PX, Math.min(left, most.left)).toFixed(0)}px`;
  words.style.top = `${Math.max(GAP_PX, Math.min(top, most.top)).toFixed(0)}px`;
}
