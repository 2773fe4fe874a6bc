// Signals of words as lanes: a box with the word for each stretch in which it stands.
import { h, theme } from './dom';
import { wordOf } from './enums';

export interface Lane {
  label: string;
  field: string;
  times: ArrayLike<number>;
  min: ArrayLike<number>;
  max: ArrayLike<number>;
}
export interface Stretch {
  from: number;
  to: number;
  /** NaN: several values. */
  value: number;
}

const kHeight = 18;
/** With the label above. */
const kPitch = 34;
const kPaletteSize = 8;

/** Rows joined while the value stands; rows without a value end a stretch. */
export function stretches(lane: Pick<Lane, 'times' | 'min' | 'max'>): Stretch[] {
  const found: Stretch[] = [];
  let open: Stretch | null = null;
  for (let i = 0; i < lane.times.length; ++i) {
    const none = !Number.isFinite(lane.min[i]);
    const value = lane.min[i] === lane.max[i] ? lane.min[i] : Number.NaN;
    if (open) open.to = lane.times[i];
    if (none) open = null;
    else if (!open || !Object.is(open.value, value)) {
      open = { from: lane.times[i], to: lane.times[i], value };
      found.push(open);
    }
  }
  return found;
}

export class Lanes {
  readonly canvas = h('canvas', { class: 'lanes', 'aria-hidden': 'true' });

  /** @param left, width of the plot above [CSS px]. */
  draw(
    lanes: Lane[],
    from: number,
    to: number,
    left: number,
    width: number,
    at: number | null,
  ): void {
    const height = lanes.length * kPitch;
    this.canvas.hidden = lanes.length === 0;
    if (lanes.length === 0 || width <= 0) return;
    const ratio = window.devicePixelRatio;
    const all = left + width + 12;
    this.canvas.style.width = `${all}px`;
    this.canvas.style.height = `${height}px`;
    this.canvas.width = Math.round(all * ratio);
    this.canvas.height = Math.round(height * ratio);
    const context = this.canvas.getContext('2d');
    if (!context) return;
    context.scale(ratio, ratio);
    context.font = '11px system-ui, sans-serif';
    context.textBaseline = 'middle';
    const x = (time: number) => left + ((time - from) / (to - from)) * width;
    lanes.forEach((lane, row) => {
      const top = row * kPitch + 14;
      for (const stretch of stretches(lane)) {
        const begin = Math.max(left, x(stretch.from));
        const end = Math.min(left + width, Math.max(x(stretch.to), begin + 1));
        if (end <= left || begin >= left + width) continue;
        this.box(context, lane.field, stretch.value, begin, end, top);
      }
      context.fillStyle = theme('--muted');
      context.textAlign = 'left';
      context.fillText(lane.label, left, top - 7, width);
    });
    if (at !== null && at >= from && at <= to) {
      context.fillStyle = theme('--accent');
      context.fillRect(x(at), 0, 1, height);
    }
  }

  private box(
    context: CanvasRenderingContext2D,
    field: string,
    value: number,
    begin: number,
    end: number,
    top: number,
  ): void {
    const several = Number.isNaN(value);
    context.globalAlpha = 0.22;
    context.fillStyle = several
      ? theme('--muted')
      : theme(`--series-${Math.abs(Math.round(value)) % kPaletteSize}`);
    context.fillRect(begin, top, end - begin, kHeight);
    context.globalAlpha = 1;
    context.fillRect(begin, top, 1, kHeight);
    const word = several ? '…' : wordOf(field, value);
    context.fillStyle = theme('--text');
    context.textAlign = 'left';
    if (context.measureText(word).width + 8 < end - begin) {
      context.fillText(word, begin + 5, top + kHeight / 2);
    }
  }
}
