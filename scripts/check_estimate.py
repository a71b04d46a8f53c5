#!/usr/bin/env python3
"""Compares what `brickmend estimate` says with what `brickmend repair` takes.

    scripts/check_estimate.py MODELS [--depth D]... [--brickmend BIN] [--work DIR] [-- ARGUMENTS]

Every model below MODELS is estimated and repaired, at each depth that is given, else at the
default. A row per run tells the ratios estimate / measured; at the end stands their distribution.
A bound that was too low is a ratio below 1. ARGUMENTS go to both commands.

Leaves are `scan.leaf_cells` of the outcome, memory is VmHWM, seconds are the wall time of the
stages. Disk is the outcome's own figure where it has one (`disk.peak_bytes`). Otherwise it is
watched from outside: the files of the work folder that a step still needs, with those that are
open and have no name. A watcher may miss a short peak.
"""

import argparse
import json
import os
import pathlib
import subprocess
import sys
import tempfile
import time

ENDINGS = {".obj", ".stl", ".ply", ".off"}
POLL_SECONDS = 0.002


def sizes(folder):
    """Sizes of the files in a folder by name, as far as they stay there."""
    found = {}
    try:
        entries = list(folder.rglob("*"))
    except FileNotFoundError:  # removed while it was listed
        return {}
    for entry in entries:
        try:
            if entry.is_file():
                found[entry.name] = entry.stat().st_size
        except OSError:
            pass
    return found


def nameless(pid, folder):
    """Bytes of open files of the folder that have no name any more."""
    total = 0
    try:
        for link in pathlib.Path(f"/proc/{pid}/fd").iterdir():
            target = os.readlink(link)
            if target.startswith(str(folder)) and target.endswith(" (deleted)"):
                total += link.stat().st_size
    except OSError:
        pass
    return total


def needed(files):
    """Bytes that the step under way needs, told by the newest file that is there."""
    steps = [
        ("verify", ("attributes", "cells", "output")),
        ("output", ("attributes", "signs", "cells", "output")),
        ("cells", ("attributes", "hits", "flips", "signs", "cells")),
        ("signs", ("attributes", "hits", "flips", "even", "sheets", "signs")),
        ("flips", ("attributes", "hits", "flips", "even", "sheets")),
        ("hits", ("attributes", "bins", "drops", "hits", "faces")),
        ("", ("",)),
    ]
    for newest, stems in steps:
        if any(name.startswith(newest) for name in files):
            return sum(size for name, size in files.items() if name.startswith(stems))
    return 0


def repair(binary, model, folder, arguments):
    """Runs a repair; exit code, outcome and the peak of the folder."""
    command = [binary, "repair", str(model), "-o", str(folder / "out.ply"), "--json", *arguments]
    with tempfile.TemporaryFile("w+") as out:
        run = subprocess.Popen(command, stdout=out, stderr=subprocess.DEVNULL)
        peak = 0
        while run.poll() is None:
            peak = max(peak, needed(sizes(folder)) + nameless(run.pid, folder))
            time.sleep(POLL_SECONDS)
        out.seek(0)
        outcome = json.load(out) if run.returncode == 0 else None
    return run.returncode, outcome, peak


def estimate(binary, model, folder, arguments):
    """What is predicted, and the seconds that it took."""
    command = [binary, "estimate", str(model), "-o", str(folder / "out.ply"), "--json", *arguments]
    start = time.monotonic()
    run = subprocess.run(command, capture_output=True, text=True, check=False)
    told = json.loads(run.stdout) if run.returncode == 0 else None
    return run.returncode, told, time.monotonic() - start


def ratios(told, outcome, peak):
    """Estimate over measured, by what was estimated."""
    disk = outcome.get("disk", {}).get("peak_bytes") or peak
    seconds = sum(stage["seconds"] for stage in outcome["stages"].values())
    return {
        "leaves": told["leaf_cells"] / max(1, outcome["scan"]["leaf_cells"]),
        "memory": told["memory_bytes"] / outcome["memory"]["peak_bytes"],
        "disk": told["disk_bytes"] / max(1, disk),
        "output": told["output_bytes"] / outcome["output"]["bytes"],
        "seconds": told["seconds"] / max(0.01, seconds),
    }


def distribution(rows):
    """One line per figure."""
    print("\n| | runs | least | 1 % | 25 % | median | 75 % | 99 % | most | below 1 |")
    print("|---|---|---|---|---|---|---|---|---|---|")
    for what in rows[0]:
        values = sorted(row[what] for row in rows)
        at = [values[min(len(values) - 1, int(len(values) * q))] for q in (0.01, 0.25, 0.5, 0.75, 0.99)]
        told = " | ".join(f"{value:.2f}" for value in [values[0], *at, values[-1]])
        print(f"| {what} | {len(values)} | {told} | {sum(value < 1 for value in values)} |")


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("models", type=pathlib.Path, nargs="+")
    parser.add_argument("--brickmend", default="target/release/brickmend")
    parser.add_argument("--depth", action="append", default=[])
    parser.add_argument("--work", default=None, help="where the outputs go for a moment")
    words = sys.argv[1:]
    split = words.index("--") if "--" in words else len(words)
    options, extra = parser.parse_args(words[:split]), words[split + 1 :]
    models = [p for root in options.models for p in root.rglob("*") if p.suffix.lower() in ENDINGS]
    depths = [["--depth", depth] for depth in options.depth] or [[]]
    rows, disagreements = [], 0
    print("| model | depth | leaves | memory | disk | output | seconds | estimated in s |")
    print("|---|---|---|---|---|---|---|---|")
    for model in sorted(models):
        for depth in depths:
            with tempfile.TemporaryDirectory(dir=options.work) as name:
                folder = pathlib.Path(name)
                code, told, took = estimate(options.brickmend, model, folder, [*depth, *extra])
                assert not list(folder.iterdir()), "an estimate leaves nothing behind"
                ended, outcome, peak = repair(options.brickmend, model, folder, [*depth, *extra])
            if told is None or outcome is None:
                # A result without a triangle (4) cannot be foreseen; all else can.
                disagreements += code != ended and ended != 4
                print(f"| {model.name} | {' '.join(depth)} | exit {code}, {ended} | | | | | |")
                continue
            row = ratios(told, outcome, peak)
            rows.append(row)
            cells = " | ".join(f"{value:.2f}" for value in row.values())
            print(f"| {model.name} | {outcome['grid']['depth']} | {cells} | {took:.2f} |", flush=True)
    if rows:
        distribution(rows)
    sys.exit(1 if disagreements else 0)


if __name__ == "__main__":
    main()
