#!/usr/bin/env python3
"""Frustum culling behind a pipe: reads a scene's frames from standard input, writes what it draws.

    plainsight judge --scene city --pipe 'python3 examples/foreign/frustum_cull.py'
    plainsight export --scene city --out - | python3 examples/foreign/frustum_cull.py |
        plainsight judge --scene city --drawn -

Standard library alone. The format is described at the top of src/foreign/mod.rs. --drop-part ID leaves a
part out, to see it caught.
"""

import argparse
import json
import sys

# The frame is drawn in single precision: a vertex may stand this share of its terms' sum away from where
# double precision has it. 23 roundings of 2**-24 each, which also covers clipping (see src/math/clip_error.rs).
MARGIN = 23 * 2.0**-24


def product(a, b):
    """a times b, column after column."""
    return [sum(a[4 * k + row] * b[4 * column + k] for k in range(4)) for column in range(4) for row in range(4)]


def outside(matrix, low, high):
    """Whether a box lies wholly beyond a side of the frustum, by more than rounding can move it."""
    corners = [(x, y, z) for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (low[2], high[2])]
    reach = [max(abs(a), abs(b)) for a, b in zip(low, high)] + [1.0]
    slack = MARGIN * max(sum(abs(matrix[4 * k + row]) * reach[k] for k in range(4)) for row in range(4))
    clip = [
        [matrix[row] * x + matrix[4 + row] * y + matrix[8 + row] * z + matrix[12 + row] for row in range(4)]
        for x, y, z in corners
    ]
    sides = (
        lambda c: c[3] + c[0],
        lambda c: c[3] - c[0],
        lambda c: c[3] + c[1],
        lambda c: c[3] - c[1],
        lambda c: c[2],
        lambda c: c[3] - c[2],
    )
    # x or y or z may be off as well as w: twice the slack.
    return any(all(side(corner) < -2.0 * slack for corner in clip) for side in sides)


def main():
    arguments = argparse.ArgumentParser(description="Frustum culling behind a pipe.")
    arguments.add_argument("--drop-part", type=int, help="a part that is never drawn")
    dropped = arguments.parse_args().drop_part

    def say(line):
        # Whoever reads is waiting for it.
        print(json.dumps(line), flush=True)

    header = json.loads(sys.stdin.readline())
    if header.get("plainsight") != "frames" or header.get("version") != 1:
        sys.exit("frustum_cull.py: this is no frames format of version 1")
    say({"plainsight": "drawn", "version": 1, "culler": "python-frustum"})
    world = {}
    # readline, not iteration, which reads ahead.
    for line in iter(sys.stdin.readline, ""):
        frame = json.loads(line)
        for moved in frame["moved"]:
            world[moved["object"]] = moved["world_from_object"]
        clip = {o: product(frame["clip_from_world"], matrix) for o, matrix in world.items()}
        drawn = []
        for part, this in enumerate(header["parts"]):
            low, high = this["min"], this["max"]
            # A box with a null is that of a part without triangles.
            empty = any(bound is None for bound in low + high)
            if part != dropped and not empty and not outside(clip[this["object"]], low, high):
                drawn.append(part)
        say({"frame": frame["frame"], "view": frame["view"], "drawn": drawn})


if __name__ == "__main__":
    main()
