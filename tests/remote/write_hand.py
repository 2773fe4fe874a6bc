#!/usr/bin/env python3
"""Writes the path of a hand that reaches and rests, 12 s at 100 Hz. Nobody's hand: it is made up.

The same from its seed on every machine: minimum-jerk strokes (Flash and Hogan 1985), most of them
followed by a smaller correcting one that overlaps it, rests between them, and a physiological tremor
around 9 Hz of 0.3 mm RMS an axis. Arguments: the seed, and how far targets are from the first place
along each axis [m].

  write_hand.py 14 0.10 0.14 0.09 > config/panda/hand.csv
  write_hand.py 29 0.08 0.10 0.08 > config/coman/hand.csv
"""
import math
import random
import sys

SECONDS, RATE_HZ = 12.0, 100
SEED, *REACH_M = int(sys.argv[1]), *map(float, sys.argv[2:5])
TREMOR_HZ, TREMOR_M = 9.0, 0.3e-3


def stroke(t):
    t = min(1.0, max(0.0, t))
    return t**3 * (10.0 - 15.0 * t + 6.0 * t * t)


def strokes(rng):
    """Start, duration [s] and displacement [m] of each."""
    at, place = 1.0, (0.0, 0.0, 0.0)
    while at < SECONDS - 1.6:
        last = at > SECONDS - 3.0
        target = (0.0, 0.0, 0.0) if last else tuple(rng.uniform(-r, r) for r in REACH_M)
        way = tuple(b - a for a, b in zip(place, target))
        lasts = 0.45 + 1.6 * math.dist(place, target)
        miss = tuple(w * rng.uniform(-0.08, 0.08) for w in way)
        yield at, lasts, tuple(w - m for w, m in zip(way, miss))
        yield at + 0.8 * lasts, 0.35, miss
        at += lasts + (rng.uniform(0.25, 0.6) if rng.random() < 0.5 else 0.1)
        place = target


def tremor(rng, count):
    """White noise through a resonance, scaled to its RMS."""
    w, damping = 2.0 * math.pi * TREMOR_HZ / RATE_HZ, 0.12
    a, b = 2.0 * math.exp(-damping * w) * math.cos(w), -math.exp(-2.0 * damping * w)
    y = [0.0, 0.0]
    for _ in range(count + 200):
        y.append(a * y[-1] + b * y[-2] + rng.gauss(0.0, 1.0))
    y = y[-count:]
    rms = math.sqrt(sum(v * v for v in y) / count)
    return [v * TREMOR_M / rms for v in y]


def main():
    rng = random.Random(SEED)
    moves = list(strokes(rng))
    count = int(SECONDS * RATE_HZ) + 1
    shakes = [tremor(rng, count) for _ in range(3)]
    print("time_s,x_m,y_m,z_m")
    for i in range(count):
        t = i / RATE_HZ
        fade = stroke(t / 0.8)  # at rest in its first place
        xyz = [sum(d[k] * stroke((t - at) / lasts) for at, lasts, d in moves) +
               fade * shakes[k][i] for k in range(3)]
        print(f"{t:.2f}," + ",".join(f"{v:.6f}" for v in xyz))


main()
