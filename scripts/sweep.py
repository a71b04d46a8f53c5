#!/usr/bin/env python3
"""Repairs every model below a folder and prints one table row per model.

    scripts/sweep.py MODELS OUT [--brickmend BIN] [--judge 'COMMAND {out}'] [-- REPAIR ARGUMENTS]

The row tells exit code, seconds, peak memory, triangles, area and volume in and out, and the
verdict's reasons. With --judge, COMMAND is run on every output; what it prints (JSON) is kept
beside the output as NAME.judge.json.
"""

import argparse
import pathlib
import shlex
import subprocess
import sys

import measure


def row(name, run, outcome):
    """A line of the table."""
    if outcome is None:
        return f"| {name} | {run.code} | {run.wall_seconds:.2f} | | | | | | | {run.stderr.strip()} |"
    proof, soup = outcome["output"]["proof"], outcome["input"]
    peak = (outcome["memory"]["peak_bytes"] or 0) / 2**20
    return (
        f"| {name} | {run.code} | {run.wall_seconds:.2f} | {peak:.0f} | {outcome['grid']['depth']} "
        f"| {proof['triangles']} | {soup['area']:.5g} → {proof['area']:.5g} "
        f"| {soup['signed_volume']:.5g} → {proof['volume']:.5g} "
        f"| {outcome['output']['area_ratio']:.3f} | {'; '.join(outcome['reasons'])} |"
    )


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("models", type=pathlib.Path)
    parser.add_argument("out", type=pathlib.Path)
    parser.add_argument("--brickmend", default="target/release/brickmend")
    parser.add_argument("--judge", help="command to run on every output, {out} is its path")
    parser.add_argument("--format", default="ply")
    parser.add_argument("--only", default="", help="models whose path contains this")
    words = sys.argv[1:]
    split = words.index("--") if "--" in words else len(words)
    arguments, extra = parser.parse_args(words[:split]), words[split + 1 :]
    arguments.out.mkdir(parents=True, exist_ok=True)
    print("| model | exit | s | MiB | depth | triangles | area in → out | volume in → out | ratio | look |")
    print("|---|---|---|---|---|---|---|---|---|---|")
    failures = 0
    for model in measure.models_below(arguments.models, arguments.only):
        output = arguments.out / f"{model.stem}.{arguments.format}"
        output.unlink(missing_ok=True)
        run, outcome = measure.repair(arguments.brickmend, model, output, extra)
        failures += run.code not in (0, 65)
        print(row(model.name, run, outcome), flush=True)
        if arguments.judge and output.exists():
            judge = [part.format(out=output) for part in shlex.split(arguments.judge)]
            verdict = subprocess.run(judge, capture_output=True, text=True, check=False).stdout
            output.with_suffix(".judge.json").write_text(verdict)
    sys.exit(1 if failures else 0)


if __name__ == "__main__":
    main()
