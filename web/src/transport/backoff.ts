/** Waits between attempts to reconnect: 0.25 s doubling to 2 s (`mostMs`), each up to a quarter shorter. */
export class Backoff {
  private attempt = 0;

  constructor(
    private readonly random: () => number = Math.random,
    private readonly mostMs = 2000,
  ) {}

  nextMs(): number {
    const full = Math.min(250 * 2 ** this.attempt, this.mostMs);
    ++this.attempt;
    return full * (1 - 0.25 * this.random());
  }

  reset(): void {
    this.attempt = 0;
  }
}
