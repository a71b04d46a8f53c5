#!/usr/bin/env python3
"""Compares what is seen of each material before and after a repair, from 14 sides.

    scripts/material_areas.py MODELS... [--brickmend BIN] [--depth auto] [--json FILE]
        [-- REPAIR ARGUMENTS]

MODELS are files, or folders that are walked. Each is repaired with an EXR preview of 14 views, whose
pixels name the material that is seen; background counts as none. Materials of the output are told by
the material of the input that lies below most of their pixels.

For each model with two materials or more: how many of the pixels that both sides fill show the same
material, and of each material that has at least one pixel in a thousand, its share of all pixels
before and after. A line ends with those that changed by more than 2 % of themselves; in brackets the
change in points of all pixels.

Needs numpy and OpenEXR from PyPI.

exit status: 0 all were measured, 1 some were not
"""

import argparse
import collections
import json
import pathlib
import subprocess
import sys
import tempfile

import numpy as np
import OpenEXR

NOTHING = 2**32 - 1
ENDINGS = {".obj", ".ply", ".glb", ".gltf", ".3mf"}
LEAST_SHARE = 1e-3
MOST_CHANGE = 0.02


def models(paths):
    """All files with an ending of a format that has materials."""
    for path in paths:
        for file in sorted(path.rglob("*")) if path.is_dir() else [path]:
            if file.suffix.lower() in ENDINGS and file.is_file():
                yield file


def seen(picture):
    """By view, the materials of the input's pixels and of the output's."""
    views = collections.defaultdict(dict)
    with OpenEXR.File(str(picture), separate_channels=True) as file:
        for part in file.parts:
            side, _, view = part.name().partition(".")
            views[view][side] = part.channels["material"].pixels.astype(np.uint32).ravel()
    return [(view["input"], view["output"]) for view in views.values()]


def compare(pairs):
    """Agreement, and by material of the input its pixels before and after."""
    before, after = (np.concatenate(side) for side in zip(*pairs))
    both = (before != NOTHING) & (after != NOTHING)
    below = {
        number: collections.Counter(before[both & (after == number)].tolist())
        for number in np.unique(after[after != NOTHING]).tolist()
    }
    names = {number: found.most_common(1)[0][0] for number, found in below.items() if found}
    told = np.array([names.get(number, NOTHING) for number in after.tolist()], dtype=np.uint32)
    agreement = (told[both] == before[both]).mean() if both.any() else float("nan")
    numbers = np.unique(before[before != NOTHING]).tolist()
    counts = {n: [int((before == n).sum()), int((told == n).sum())] for n in numbers}
    return float(agreement), counts


def measure(model, options, folder):
    """What is found of a model, or why not."""
    picture, output = folder / "seen.exr", folder / ("out" + model.suffix.lower().replace("gltf", "glb"))
    command = [options.brickmend, "repair", model, "-o", output, "--fresh", "--quiet"]
    command += ["--depth", options.depth, "--preview", picture, "--preview-views", "14"]
    command += ["--no-deviation", *options.rest]
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True)
    if done.returncode != 0:
        return {"model": str(model), "failed": done.stderr.strip()[-300:]}
    agreement, counts = compare(seen(picture))
    return {"model": str(model), "agreement": agreement, "pixels": counts}


def line(found):
    """A line of text."""
    sums = [sum(counts[side] for counts in found["pixels"].values()) for side in (0, 1)]
    changed = []
    for number, (before, after) in found["pixels"].items():
        one, other = before / sums[0], after / max(sums[1], 1)
        if one >= LEAST_SHARE and abs(other - one) > MOST_CHANGE * one:
            changed.append(f"{number}: {one:.2%} -> {other:.2%} ({100 * (other - one):+.2f})")
    return f"{found['agreement']:.2%} of {len(found['pixels'])} " + ", ".join(changed)


def main():
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("models", nargs="+", type=pathlib.Path)
    options.add_argument("--brickmend", default="target/release/brickmend")
    options.add_argument("--depth", default="auto")
    options.add_argument("--json", type=pathlib.Path)
    words, rest = sys.argv[1:], []
    if "--" in words:
        words, rest = words[: words.index("--")], words[words.index("--") + 1 :]
    options = options.parse_args(words)
    options.rest = rest
    results = []
    for model in models(options.models):
        with tempfile.TemporaryDirectory() as folder:
            found = measure(model, options, pathlib.Path(folder))
        if "failed" in found:
            print(f"{model}: not measured: {found['failed']}", flush=True)
        elif len(found["pixels"]) >= 2:
            print(f"{model}: {line(found)}", flush=True)
        results.append(found)
        if options.json:
            options.json.write_text(json.dumps(results, indent=1))
    agreements = [r["agreement"] for r in results if len(r.get("pixels", ())) >= 2]
    if agreements:
        print(f"{len(agreements)} models: agreement median {np.median(agreements):.2%}, "
              f"least {min(agreements):.2%}")
    return int(any("failed" in result for result in results))


if __name__ == "__main__":
    sys.exit(main())
