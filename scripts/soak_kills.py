#!/usr/bin/env python3
"""Kills a repair at random moments, again and again, and checks what comes of it.

    scripts/soak_kills.py [--kills 200] [--depth 10] [--triangles 1000000] [--seed 1]
                          [--brickmend BIN] [--folder DIR]

Makes a broken model, repairs it once without interruption, then starts the same command over and
over, each time killing it (SIGKILL) after a random time, until it ends by itself; then begins anew
until all kills are spent. Every output must have the bytes of the first one, and nothing may be
left over. Tells the work lost per kill: seconds spent beyond those of the uninterrupted run.
"""

import argparse
import hashlib
import math
import pathlib
import random
import shutil
import struct
import subprocess
import sys
import tempfile
import time


def write_model(path, triangles, generator):
    """A sphere as binary STL, of which one triangle in a hundred is missing."""
    sides = max(8, int(math.sqrt(triangles / 2)))
    rings = sides

    def corner(ring, side):
        polar = math.pi * ring / rings
        angle = 2 * math.pi * side / sides
        return (math.sin(polar) * math.cos(angle), math.sin(polar) * math.sin(angle), math.cos(polar))

    count = 0
    with open(path, "wb") as file:
        file.write(b" " * 80 + struct.pack("<I", 0))
        for ring in range(rings):
            upper = [corner(ring, side) for side in range(sides + 1)]
            lower = [corner(ring + 1, side) for side in range(sides + 1)]
            block = bytearray()
            for side in range(sides):
                a, b, c, d = upper[side], lower[side], lower[side + 1], upper[side + 1]
                for corners in ((a, b, c), (a, c, d)):
                    if generator.random() < 0.01:
                        continue
                    numbers = [x for point in corners for x in point]
                    block += struct.pack("<12fH", 0, 0, 0, *numbers, 0)
                    count += 1
            file.write(block)
        file.seek(80)
        file.write(struct.pack("<I", count))
    return count


def digest(path):
    """Hash of a file."""
    hasher = hashlib.sha256()
    with open(path, "rb") as file:
        while block := file.read(1 << 20):
            hasher.update(block)
    return hasher.hexdigest()


def run(command, limit_s=None):
    """Runs the command, for at most so long: whether it ended by itself, and after how long."""
    start = time.monotonic()
    process = subprocess.Popen(command, stderr=subprocess.PIPE, text=True)
    try:
        _, message = process.communicate(timeout=limit_s)
    except subprocess.TimeoutExpired:
        process.kill()
        process.communicate()
        return False, time.monotonic() - start
    if process.returncode != 0:
        sys.exit(f"exit {process.returncode}: {message}")
    return True, time.monotonic() - start


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("--kills", type=int, default=200)
    parser.add_argument("--depth", type=int, default=10)
    parser.add_argument("--triangles", type=int, default=1_000_000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--brickmend", default="target/release/brickmend")
    parser.add_argument("--folder", type=pathlib.Path)
    arguments = parser.parse_args()
    generator = random.Random(arguments.seed)
    folder = pathlib.Path(tempfile.mkdtemp(dir=arguments.folder))
    model, output = folder / "model.stl", folder / "out.ply"
    count = write_model(model, arguments.triangles, generator)
    command = [arguments.brickmend, "repair", str(model), "-o", str(output)]
    command += ["--depth", str(arguments.depth), "-q"]
    whole_s = min(run(command)[1] for _ in range(3))
    expected = digest(output)
    print(f"{count} triangles, depth {arguments.depth}: {whole_s:.2f} s without interruption")
    killed = completed = 0
    spent_s = 0.0
    while killed < arguments.kills:
        output.unlink()
        ended = False
        while not ended:
            limit_s = generator.uniform(0, whole_s) if killed < arguments.kills else None
            ended, seconds = run(command, limit_s)
            spent_s += seconds
            killed += not ended
        completed += 1
        if digest(output) != expected:
            sys.exit(f"other bytes after {killed} kills; see {folder}")
        left = sorted(path.name for path in folder.iterdir())
        if left != ["model.stl", "out.ply"]:
            sys.exit(f"left over after {killed} kills: {left}")
        print(f"{killed} kills, {completed} outputs, {spent_s:.0f} s", flush=True)
    lost_s = (spent_s - completed * whole_s) / killed
    print(f"{killed} kills, {completed} outputs, all alike, nothing left over")
    print(f"lost per kill: {lost_s:.2f} s, {100 * lost_s / whole_s:.0f} % of a run")
    shutil.rmtree(folder)


if __name__ == "__main__":
    main()
