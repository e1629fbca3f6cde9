// One value that others follow.

/** A value with listeners; setting it tells them, at once. */
export class Watched<T> {
  private readonly listeners = new Set<(value: T) => void>();

  constructor(private current: T) {}

  get value(): T {
    return this.current;
  }

  set(value: T): void {
    if (Object.is(value, this.current)) return;
    this.current = value;
    for (const listener of [...this.listeners]) listener(value);
  }

  /** Tell `listener` now and of every change. */
  watch(listener: (value: T) => void): () => void {
    listener(this.current);
    return this.follow(listener);
  }

  /** Tell `listener` of every change from now on. */
  follow(listener: (value: T) => void): () => void {
    this.listeners.add(listener);
    return () => this.listeners.delete(listener);
  }
}
