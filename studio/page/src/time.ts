// One visible span and one selected time for all panes and the 3D view.

export const kWidths = [5, 10, 30, 60];

export class TimeModel {
  /** Of the newest values. NaN: nothing came yet. */
  now = Number.NaN;
  /** Seconds that are seen while the picture follows the run. */
  width = 10;
  /** What is seen while it does not. */
  frozen: { from: number; to: number } | null = null;
  /** The time at which everything is shown; null: now. */
  selected: number | null = null;
  /** Below the pointer. */
  hover: number | null = null;
  /** All that there is, of a recording: it is seen instead of what comes; null: a run goes on. */
  whole: { from: number; to: number } | null = null;
  private readonly listeners: (() => void)[] = [];

  on(listener: () => void): void {
    this.listeners.push(listener);
  }

  span(): { from: number; to: number } {
    if (this.frozen) return this.frozen;
    const to = Number.isFinite(this.now) ? Math.max(this.now, this.width) : this.width;
    return { from: to - this.width, to };
  }
  /** The time whose values the lists show. */
  shown(): number {
    return this.hover ?? this.selected ?? this.now;
  }

  follow(width = this.width): void {
    this.width = width;
    this.frozen = this.whole;
    this.changed();
  }
  /** The picture stands; the robot does not notice. */
  freeze(from = this.span().from, to = this.span().to): void {
    if (!(to > from)) return;
    this.frozen = { from, to };
    this.changed();
  }
  zoom(factor: number): void {
    const { from, to } = this.span();
    const middle = this.selected ?? (from + to) / 2;
    this.freeze(Math.max(0, middle - (middle - from) * factor), middle + (to - middle) * factor);
  }
  /** Moves what is seen by a share of its width. */
  pan(share: number): void {
    const { from, to } = this.span();
    const by = Math.max(share * (to - from), -from);
    if (this.frozen && !this.whole && Number.isFinite(this.now) && to + by >= this.now && share > 0)
      this.follow();
    else this.freeze(from + by, to + by);
  }
  select(time: number | null): void {
    const { whole } = this;
    if (!whole) this.selected = time === null ? null : Math.max(0, time);
    else if (time !== null) this.selected = Math.min(whole.to, Math.max(whole.from, time));
    this.changed();
  }
  /** The run went back to `time`: what is selected or seen after it is not there any more. */
  goBack(time: number): void {
    this.now = time;
    this.hover = null;
    if (this.selected !== null && this.selected > time) this.selected = null;
    if (this.frozen && this.frozen.from >= time) this.frozen = null;
    this.changed();
  }
  point(time: number | null): void {
    if (this.hover === time) return;
    this.hover = time;
    this.changed();
  }

  private changed(): void {
    for (const listener of this.listeners) listener();
  }
}
