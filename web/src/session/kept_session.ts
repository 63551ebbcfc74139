import type { Role } from './types';

type SessionStorage = Pick<Storage, 'getItem' | 'setItem' | 'removeItem'>;

/**
 * The session of this tab, to go on with after a reload: what was done can still be undone. It belongs
 * to its name, and to its role: the expert's page and the wearer's may follow each other in one tab.
 */
export class KeptSession {
  private readonly key: string;

  constructor(
    private readonly storage: SessionStorage,
    role: Role,
    /** True where another tab may go on with it: a duplicate begins with the storage of its model. */
    readonly maybeShared = false,
  ) {
    this.key = `saccade.session.${role}`;
  }

  /** Empty: none of this name. */
  recall(name: string): string {
    try {
      const kept: unknown = JSON.parse(this.storage.getItem(this.key) ?? 'null');
      if (typeof kept !== 'object' || kept === null) return '';
      const { id, name: whose } = kept as { id?: unknown; name?: unknown };
      return whose === name && typeof id === 'string' ? id : '';
    } catch {
      return '';
    }
  }

  keep(id: string, name: string): void {
    try {
      this.storage.setItem(this.key, JSON.stringify({ id, name }));
    } catch {
      // Full or forbidden: then a reload begins a new session.
    }
  }

  forget(): void {
    this.storage.removeItem(this.key);
  }
}
