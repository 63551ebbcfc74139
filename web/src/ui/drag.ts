/** What a press does from when it went down until it is let go. Places are pixels of the page. */
export interface Drag {
  /** True where a press that did not move is a click. */
  readonly clicks: boolean;
  move(x: number, y: number): void;
  end(x: number, y: number): void;
  /** Nothing has come of it. */
  cancel(): void;
  /** True where a move is wanted at once, not with the screen's next frame. */
  readonly prompt?: boolean;
  /** Once per screen frame: the picture may have moved under a pointer that has not. */
  tick?(): void;
}
