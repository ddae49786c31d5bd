interface Held<T> {
  readonly value: Promise<T>;
  users: number;
}

/** What several chunks use, by number: made for the first user, dropped after the last. */
export class Pool<T> {
  private readonly held = new Map<number, Held<T>>();
  private readonly make: (number: number) => Promise<T>;
  private readonly drop: (value: T) => void;

  constructor(make: (number: number) => Promise<T>, drop: (value: T) => void) {
    this.make = make;
    this.drop = drop;
  }

  /** One user more. */
  take(number: number): Promise<T> {
    let held = this.held.get(number);
    if (!held) this.held.set(number, held = { value: this.make(number), users: 0 });
    held.users++;
    return held.value;
  }

  /** What has users. */
  get(number: number): Promise<T> | undefined {
    return this.held.get(number)?.value;
  }

  /** One user less. */
  letGo(number: number): void {
    const held = this.held.get(number);
    if (!held || --held.users > 0) return;
    this.held.delete(number);
    // What did not come needs no dropping.
    held.value.then(this.drop, () => undefined);
  }
}
