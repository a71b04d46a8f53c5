#!/usr/bin/env python3
"""Makes a folder of small models, all different, for soaks and for the time that a batch adds.

    scripts/make_catalogue.py DIR [--count N] [--broken SHARE]

Boxes as OBJ in folders of 1000; of SHARE of them a side is missing.
"""

import argparse
import pathlib

FACES = ["1 3 4 2", "5 6 8 7", "1 2 6 5", "3 7 8 4", "1 5 7 3", "2 4 8 6"]


def box(number, is_broken):
    """The text of a box whose size tells it from all others."""
    size = [1 + (number % 97) / 97, 1 + (number // 97 % 89) / 89, 1 + number // 8633 / 50]
    lines = [f"# {number}"]
    for corner in range(8):
        places = [size[axis] * (corner >> axis & 1) for axis in range(3)]
        lines.append("v {:.6f} {:.6f} {:.6f}".format(*places))
    lines += [f"f {face}" for face in FACES[is_broken:]]
    return "\n".join(lines) + "\n"


def main():
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("folder", type=pathlib.Path)
    options.add_argument("--count", type=int, default=10_000)
    options.add_argument("--broken", type=float, default=0.5)
    asked = options.parse_args()
    for number in range(asked.count):
        folder = asked.folder / f"{number // 1000:04}"
        folder.mkdir(parents=True, exist_ok=True)
        is_broken = number % 1000 < 1000 * asked.broken
        (folder / f"box_{number:06}.obj").write_text(box(number, is_broken))


if __name__ == "__main__":
    main()
