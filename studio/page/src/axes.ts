// What plots have in common: their axes, and columns as uPlot wants them.
import type uPlot from 'uplot';
import { theme } from './dom';
import { tick } from './format';

function axis(scale: string, side: number, label: string): uPlot.Axis {
  return {
    scale,
    side,
    label: label || ' ',
    labelSize: 16,
    labelGap: 0,
    size: 48,
    labelFont: '11px system-ui',
    font: '11px system-ui',
    gap: 3,
    stroke: () => theme('--muted'),
    grid: { stroke: () => theme('--grid'), width: 1, show: side !== 1 },
    ticks: { show: false },
  };
}

/** Of `labels` those that a picture `width` wide has place for, their middles at `places`. */
export function uncut(
  labels: string[],
  places: number[],
  widths: number[],
  width: number,
): string[] {
  return labels.map((label, i) => (places[i] + widths[i] / 2 > width ? '' : label));
}

/** The axis below a plot. A label that would be cut off at the right is left out. */
export function timeAxis(words: (value: number) => string): uPlot.Axis {
  return {
    ...axis('x', 2, ''),
    labelSize: 0,
    size: 22,
    values: (u, ticks) => {
      const labels = ticks.map(words);
      const { canvas, font } = u.ctx;
      u.ctx.font = `${11 * devicePixelRatio}px system-ui`;
      const widths = labels.map((label) => u.ctx.measureText(label).width);
      u.ctx.font = font;
      const places = ticks.map((one) => u.valToPos(one, 'x', true));
      return uncut(labels, places, widths, canvas.width);
    },
  };
}

/** An axis on the left for the first unit, on the right for the second; scales are `y UNIT`. */
export function unitAxes(units: string[]): uPlot.Axis[] {
  return units.slice(0, 2).map((unit, i) => ({
    ...axis(`y ${unit}`, i === 0 ? 3 : 1, unit),
    values: (_: uPlot, ticks: number[]) => ticks.map(tick),
  }));
}

/** Values with null where there is none. */
export function listed(values: ArrayLike<number>): (number | null)[] {
  return Array.from(values, (one) => (Number.isFinite(one) ? one : null));
}
