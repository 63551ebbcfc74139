import type { Placed } from '../session/scene_edits';
import type { Session } from '../session/session';
import type { AppState, PaneName } from './app_state';
import { whyNotEdit } from './rights';

/** What is asked of the server about things, one after the other, and what is said of it. */
export class ThingErrands {
  said = { text: '', warn: false };
  private busy = false;

  constructor(
    private readonly session: Session,
    private readonly state: AppState,
  ) {}

  /** One at a time: what comes meanwhile is passed over, as a key that is held. */
  run(pane: PaneName, act: () => Promise<string>, words = 'Not done: '): void {
    const why = whyNotEdit(this.session);
    if (why !== undefined) return this.say(why, true);
    if (this.busy) return;
    this.busy = true;
    void act()
      .then((text) => this.say(text))
      .catch((error: unknown) => {
        const reason = error instanceof Error ? error.message : String(error);
        if (pane !== 'map' || this.state.main === 'map') this.state.refuse(pane, words + reason);
        this.say(words + reason, true);
      })
      .finally(() => {
        this.busy = false;
      });
  }

  refuse(pane: PaneName, why: string): void {
    this.state.refuse(pane, `Not done: ${why}`);
    this.say(`Not done: ${why}`, true);
  }

  say(text: string, warn = false): void {
    this.said = { text, warn };
    this.state.changed();
  }
}

/** What a thing touched on its way, and what it came to rest on. */
export function placedWords({ thing, stop, slidM, slideStop, support }: Placed): string {
  const moved = stop ? `touches ${stop.name} after ${stop.movedM.toFixed(3)} m, ` : '';
  const to = slideStop ? ` to ${slideStop.name}` : '';
  const slid = slidM > 0 ? `slides ${slidM.toFixed(3)} m${to}, ` : '';
  return `${thing.name} ${moved}${slid}rests on ${support.name}`;
}
