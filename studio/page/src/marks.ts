// Events on the time axis of a plot, the selected time, and the event beside the pointer.
import type uPlot from 'uplot';
import type { Data } from './data';
import { theme } from './dom';
import { onPaper } from './paper';
import type { RunEvent } from './protocol';

const kNear_px = 8;

export function signOf(level: string): string {
  if (level === 'error') return '▲';
  return level === 'warn' ? '◆' : '●';
}

export function eventMarks(plot: uPlot, data: Data): void {
  const { from, to } = data.time.span();
  const context = plot.ctx;
  const { left, top, width, height } = plot.bbox;
  const ratio = devicePixelRatio;
  const x = (time: number) => left + ((time - from) / (to - from)) * width;
  context.save();
  context.font = `${9 * ratio}px system-ui`;
  context.textAlign = 'center';
  context.lineWidth = ratio;
  for (const event of data.events) {
    if (event.time_s < from || event.time_s > to) continue;
    const at = Math.round(x(event.time_s)) + 0.5;
    const colour =
      event.level === 'error' ? '--bad' : event.level === 'warn' ? '--warn' : '--muted';
    context.strokeStyle = theme(colour);
    context.fillStyle = theme(colour);
    context.setLineDash([2 * ratio, 3 * ratio]);
    context.beginPath();
    context.moveTo(at, top);
    context.lineTo(at, top + height);
    context.stroke();
    context.fillText(signOf(event.level), at, top + 8 * ratio);
  }
  const { selected } = data.time;
  if (selected !== null && !onPaper() && selected >= from && selected <= to) {
    context.setLineDash([]);
    context.strokeStyle = theme('--accent');
    context.lineWidth = 1.5 * ratio;
    context.beginPath();
    context.moveTo(x(selected), top);
    context.lineTo(x(selected), top + height);
    context.stroke();
  }
  context.restore();
}

/** The event beside the shown time, within some pixels of a plot of this width. */
export function eventNear(data: Data, plotWidth: number): RunEvent | null {
  const time = data.time.hover ?? data.time.selected;
  if (time === null || plotWidth <= 0) return null;
  const { from, to } = data.time.span();
  const reach = (kNear_px / plotWidth) * (to - from);
  let best: RunEvent | null = null;
  for (const event of data.events) {
    const away = Math.abs(event.time_s - time);
    if (away <= reach && (!best || away < Math.abs(best.time_s - time))) best = event;
  }
  return best;
}
