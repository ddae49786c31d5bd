#!/usr/bin/env python3
"""Models that hide little and cut much, as OBJ: what a split must be bounded for.

    python3 scripts/soups.py KIND TRIANGLES > model.obj

KIND: triangles (0.2 to 2 m, anyhow), splinters (4 to 15 m long, 0.1 m wide), boxes (0.2 to 2 m, turned anyhow), terrain (a grid of 2 m), bars (a
hall of 60 m with round bars that stand upright).
"""

import math
import random
import sys


def anyhow(count, side):
    for _ in range(count):
        middle, half = place(side), random.uniform(0.1, 1.0)
        yield [[c + random.uniform(-half, half) for c in middle] for _ in range(3)]


def splinters(count, side):
    for _ in range(count):
        a, along = place(side), [random.gauss(0, 1) for _ in range(3)]
        length = random.uniform(4, 15) / math.hypot(*along)
        yield [a, [p + length * d for p, d in zip(a, along)],
               [p + 0.5 * length * d + random.uniform(-0.05, 0.05) for p, d in zip(a, along)]]


def boxes(count, side):
    for _ in range(count // 12):
        yield from box(place(side), [random.uniform(0.1, 1.0) for _ in range(3)], turn())


def terrain(count, _):
    n = math.isqrt(count // 2)
    rough = [[random.uniform(-0.15, 0.15) for _ in range(n + 1)] for _ in range(n + 1)]

    def at(i, j):
        x, z = 2.0 * i, 2.0 * j
        return [x, 3 * math.sin(0.13 * x) + 2 * math.cos(0.17 * z) + rough[i][j], z]

    for i in range(n):
        for j in range(n):
            yield [at(i, j), at(i, j + 1), at(i + 1, j + 1)]
            yield [at(i, j), at(i + 1, j + 1), at(i + 1, j)]


def bars(count, _):
    side, height, straight = 60.0, 8.0, [[1, 0, 0], [0, 1, 0], [0, 0, 1]]
    for middle, half in [([30, -0.1, 30], [30, 0.1, 30]), ([30, 8.1, 30], [30, 0.1, 30]), ([0, 4, 30], [0.1, 4, 30]),
                         ([60, 4, 30], [0.1, 4, 30]), ([30, 4, 0], [30, 4, 0.1]), ([30, 4, 60], [30, 4, 0.1])]:
        yield from box(middle, half, straight)
    for _ in range(max(count - 72, 0) // 80):
        x, z, low, r = random.uniform(0, side), random.uniform(0, side), random.uniform(0, height), random.uniform(0.05, 0.3)
        high = min(height, low + random.uniform(1, 4))
        ring = [(x + r * math.cos(i * math.pi / 10), z + r * math.sin(i * math.pi / 10)) for i in range(21)]
        for (a, b), (c, d) in zip(ring, ring[1:]):
            yield [[a, low, b], [c, high, d], [c, low, d]]
            yield [[a, low, b], [a, high, b], [c, high, d]]
            yield [[x, low, z], [a, low, b], [c, low, d]]
            yield [[x, high, z], [c, high, d], [a, high, b]]


def place(side):
    return [random.uniform(0, side), random.uniform(0, side / 2), random.uniform(0, side)]


def turn():
    (a, b), (c, d) = ((math.cos(t), math.sin(t)) for t in (random.uniform(0, 2 * math.pi) for _ in range(2)))
    return [[a, -b * c, b * d], [b, a * c, -a * d], [0, d, c]]


def box(middle, half, axes):
    corner = [[m + sum(row[k] * half[k] * (1 if i >> k & 1 else -1) for k in range(3)) for m, row in zip(middle, axes)]
              for i in range(8)]
    for a, b, c, d in [(0, 4, 6, 2), (1, 3, 7, 5), (0, 1, 5, 4), (2, 6, 7, 3), (0, 2, 3, 1), (4, 5, 7, 6)]:
        yield [corner[a], corner[b], corner[c]]
        yield [corner[a], corner[c], corner[d]]


KINDS = {"triangles": anyhow, "splinters": splinters, "boxes": boxes, "terrain": terrain, "bars": bars}

if __name__ == "__main__":
    if len(sys.argv) != 3 or sys.argv[1] not in KINDS:
        sys.exit(__doc__)
    random.seed(0)
    number = int(sys.argv[2])
    # As dense at any size as 4,000 in 20 m.
    size = 20 * (number / 4000) ** (1 / 3)
    corners = 0
    for index, triangle in enumerate(KINDS[sys.argv[1]](number, size)):
        if index % 50 == 0:
            print(f"o part {index // 50}")
        for point in triangle:
            print("v %.5f %.5f %.5f" % tuple(point))
        print("f", corners + 1, corners + 2, corners + 3)
        corners += 3
