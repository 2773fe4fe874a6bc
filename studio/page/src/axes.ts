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

/** The axis below a plot; its values are the owner's. */
export function timeAxis(): uPlot.Axis {
  return { ...axis('x', 2, ''), labelSize: 0, size: 22 };
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
