#!/usr/bin/env python3
"""Repairs every model at every clustering threshold and tells what comes of it.

    scripts/quality.py MODELS OUT [--decimate 0cells,0.1cells,0.5cells,1cells] [--depth 9]
        [--brickmend BIN] [--judge COMMAND] [--chosen NAME,NAME,NAME] [--field 'NAME=PATH']...
        [-- REPAIR ARGUMENTS]

First all repairs, one after the other, so that their times are undisturbed; then the judge, if
there is one, on every output against its input (see `judge` in measure.py). Without --decimate
every model is repaired once, without that flag.

OUT/quality.md has a table over all models, sums over each threshold, and, for the chosen models
(else the three with the most vertices), vertices, triangles and seconds over the thresholds.
OUT/quality.json has all of it with the whole outcomes; a second call goes on from there and redoes
only what is missing or was made by another binary or with other arguments. --field adds a column
from the outcome by its path, such as 'fans=output.contour.fans'. Peaks are VmHWM.

exit status: 0 all repaired or refused as unreadable, 1 a repair failed or a judge found a defect
"""

import argparse
import hashlib
import json
import multiprocessing.pool
import os
import pathlib
import shutil
import sys

import measure

UNREADABLE = 65
PLAIN = "default"


def identity(arguments, extra):
    """What decides about the results: the program's bytes and its arguments."""
    program = shutil.which(arguments.brickmend)
    if program is None:
        raise SystemExit(f"{arguments.brickmend}: not found")
    digest = hashlib.sha256(pathlib.Path(program).read_bytes())
    digest.update(json.dumps([arguments.depth, arguments.max_memory, arguments.format, extra]).encode())
    return digest.hexdigest()


def is_judged(row):
    """Whether the judge has come to a verdict."""
    return "valid" in row.get("judge", {})


class Sweep:
    """All rows: `rows[model][threshold]`, kept in OUT/quality.json."""

    def __init__(self, arguments, extra):
        self.arguments, self.extra = arguments, extra
        self.thresholds = arguments.decimate or [PLAIN]
        self.key, self.start = identity(arguments, extra), measure.machine()
        self.path = arguments.out / "quality.json"
        self.rows = {}
        if self.path.exists():
            before = json.loads(self.path.read_text())
            if before["key"] == self.key:
                self.rows, self.start = before["rows"], before["start"]

    def save(self):
        """Whole or not at all."""
        partial = self.path.with_suffix(".partial")
        told = {"key": self.key, "start": self.start, "rows": self.rows}
        partial.write_text(json.dumps(told, indent=1) + "\n")
        os.replace(partial, self.path)

    def output(self, name, threshold):
        """Where the result lies until it is judged."""
        words = f"{name}__{threshold}".replace("/", "__").replace("%", "percent")
        return self.arguments.out / f"{words}.{self.arguments.format}"

    def repair(self, name, model, threshold):
        """One repair, unless it is known."""
        output, row = self.output(name, threshold), self.rows.setdefault(name, {}).get(threshold)
        if row and (output.exists() or row["code"] != 0 or not self.arguments.judge or is_judged(row)):
            return
        options = ["--depth", str(self.arguments.depth), "--max-memory", self.arguments.max_memory, "--fresh"]
        options += [] if threshold == PLAIN else ["--decimate", threshold]
        output.unlink(missing_ok=True)
        run, outcome = measure.repair(
            self.arguments.brickmend, model, output, [*options, *self.extra], self.arguments.timeout
        )
        failure = run.failure() and run.failure().replace(str(model), model.name)
        self.rows[name][threshold] = {
            "code": run.code, "failure": failure, "wall_seconds": run.wall_seconds,
            "cpu_seconds": run.cpu_seconds, "outcome": outcome,
        }
        if not self.arguments.keep:
            # What a failed repair leaves for going on.
            shutil.rmtree(f"{output}.brickmend", ignore_errors=True)
        self.save()
        print(f"{name}, {threshold}: {failure or f'{run.wall_seconds:.2f} s'}", flush=True)

    def judge(self, task):
        """The judge's word on one output; None where there is nothing to judge or it is known."""
        name, model, threshold = task
        row = self.rows[name][threshold]
        if row["code"] != 0 or is_judged(row):
            return task, None
        output, first = (self.output(name, t) for t in (threshold, self.thresholds[0]))
        words = measure.judge(self.arguments.judge, output, model)
        if output != first and first.exists() and "valid" in words:
            words["to_first"] = measure.distance(self.arguments.judge, output, first)
        return task, words

    def run(self, models):
        """All repairs, then all judging."""
        tasks = [(name, model, threshold) for name, model in models for threshold in self.thresholds]
        for task in tasks:
            self.repair(*task)
        if self.arguments.judge:
            with multiprocessing.pool.ThreadPool(self.arguments.judge_jobs) as pool:
                for (name, _, threshold), words in pool.imap(self.judge, tasks):
                    if words:
                        self.rows[name][threshold]["judge"] = words
                        self.save()
                        print(f"{name}, {threshold}: {words}", flush=True)
        if not self.arguments.keep:
            for name, _, threshold in tasks:
                self.output(name, threshold).unlink(missing_ok=True)


def distances(row):
    """Hausdorff in % of the diagonal; out to in, visible in to out, to the first threshold's, in cells."""
    if not is_judged(row):
        return [None] * 4
    words, cell = row["judge"], row["outcome"]["cell_size"]
    cells, to_first = words["diagonal"] / cell, words.get("to_first")
    told_cells = [words["out_to_in"] * cells, words["visible_in_to_out"] * cells]
    return [100 * words["hausdorff"], *told_cells, None if to_first is None else to_first / cell]


def line_of(name, threshold, row, fields):
    """A line of the long table."""
    outcome = row["outcome"]
    if outcome is None:
        return [name, threshold, row["failure"], *[""] * (10 + len(fields))]
    proof, words = outcome["output"]["proof"], row.get("judge", {})
    peak = (outcome["memory"]["peak_bytes"] or 0) / 2**20
    return [
        name, threshold, measure.short(proof["triangles"]), measure.short(proof["vertices"]),
        measure.short(row["cpu_seconds"]), measure.short(row["wall_seconds"]), f"{peak:.0f}",
        words.get("failure", measure.short(words.get("intersecting_pairs"))),
        *[measure.short(distance) for distance in distances(row)],
        {True: "yes", False: "no", None: ""}[words.get("valid")],
        *[told(measure.dig(outcome, path)) for _, path in fields],
    ]


def told(value):
    """A field of an outcome as a cell of a table."""
    return measure.short(value) if isinstance(value, (int, float)) and not isinstance(value, bool) else value or ""


def proof_of(row):
    """What the proof counted in a result."""
    return row["outcome"]["output"]["proof"]


def sums(rows, thresholds):
    """One line per threshold over all models that were repaired."""
    head = [
        "threshold", "models", "triangles", "vertices", "CPU s", "largest peak MiB", "intersecting pairs",
        "models with pairs", "valid", "largest out → in, cells", "largest to first threshold, cells",
    ]
    lines = []
    for threshold in thresholds:
        good = [r[threshold] for r in rows.values() if r.get(threshold, {}).get("outcome")]
        judged = [r for r in good if is_judged(r)]
        proofs = [proof_of(r) for r in good]
        pairs = [r["judge"]["intersecting_pairs"] for r in judged]
        peaks = [(r["outcome"]["memory"]["peak_bytes"] or 0) / 2**20 for r in good]
        line = [threshold, len(good), *[measure.short(sum(p[n] for p in proofs)) for n in ("triangles", "vertices")]]
        line += [measure.short(sum((r["cpu_seconds"] for r in good), 0.0)), f"{max(peaks, default=0):.0f}"]
        if judged:
            valid = sum(r["judge"]["valid"] for r in judged)
            line += [measure.short(sum(pairs)), sum(p > 0 for p in pairs), f"{valid} of {len(judged)}"]
            largest = lambda k: max((distances(r)[k] for r in judged if distances(r)[k] is not None), default=None)
            line += [measure.short(largest(1)), measure.short(largest(3))]
        lines.append(line + [""] * (len(head) - len(line)))
    return measure.table(head, lines)


def over_thresholds(rows, chosen, thresholds, title, value):
    """A table with a line per threshold and a column per chosen model."""
    lines = []
    for threshold in thresholds:
        found = [rows[name].get(threshold, {}) for name in chosen]
        lines.append([threshold, *[measure.short(value(row)) if row.get("outcome") else "" for row in found]])
    return f"### {title}\n\n" + measure.table(["threshold", *[pathlib.Path(name).stem for name in chosen]], lines)


def choose(rows, names, thresholds):
    """The named models, else the three with the most vertices at the first threshold."""
    def vertices(name):
        outcome = rows[name].get(thresholds[0], {}).get("outcome")
        return outcome["output"]["proof"]["vertices"] if outcome else 0

    if names:
        return [name for name in rows if any(word in name for word in names)]
    return sorted((n for n in rows if vertices(n)), key=lambda n: (-vertices(n), n))[:3]


def page(sweep, rows, thresholds):
    """All tables."""
    arguments, start = sweep.arguments, sweep.start
    fields = [(name, path) for name, _, path in (word.partition("=") for word in arguments.field)]
    head = [
        "model", "threshold", "triangles", "vertices", "CPU s", "wall s", "peak MiB", "intersecting pairs",
        "Hausdorff, % of diagonal", "out → in, cells", "visible in → out, cells",
        "to first threshold, cells", "valid",
        *[name for name, _ in fields],
    ]
    long = [line_of(n, t, rows[n][t], fields) for n in rows for t in thresholds if t in rows[n]]
    chosen = choose(rows, arguments.chosen, thresholds)
    outcomes = [row["outcome"] for of in rows.values() for row in of.values() if row["outcome"]]
    version = outcomes[0]["version"] if outcomes else "?"
    words = " ".join(["--depth", str(arguments.depth), "--max-memory", arguments.max_memory, *sweep.extra])
    return "\n".join([
        "# Quality over clustering thresholds\n",
        f"Written by `scripts/quality.py`. brickmend {version}, `{words}`; {start['date']}; {start['machine']};"
        f" {start['system']}; load before the first run: {start['load']:.2f}.\n",
        "Distances are the judge's, from samples: out → in is the largest from the result to the input, the"
        " other way only what can be seen of the input counts. Hausdorff is over all, hidden parts too. To"
        " first threshold: the larger of both ways between this result and that of the first threshold. Valid:"
        " closed, manifold, outward, no degenerate triangle, no intersecting pair.\n",
        "## Sums\n", sums(rows, thresholds),
        "## Chosen models\n",
        over_thresholds(rows, chosen, thresholds, "Vertices", lambda r: proof_of(r)["vertices"]),
        over_thresholds(rows, chosen, thresholds, "Triangles", lambda r: proof_of(r)["triangles"]),
        over_thresholds(rows, chosen, thresholds, "Wall seconds", lambda r: r["wall_seconds"]),
        over_thresholds(rows, chosen, thresholds, "CPU seconds", lambda r: r["cpu_seconds"]),
        "## All models\n", measure.table(head, long),
    ])


def parse():
    """The arguments, and what is handed on to every repair."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter,
        usage="%(prog)s MODELS OUT [options] [-- REPAIR ARGUMENTS]",
    )
    split_words = lambda text: [word for word in text.split(",") if word]
    parser.add_argument("models", type=pathlib.Path, help="folder, or one model")
    parser.add_argument("out", type=pathlib.Path, help="folder for tables and, for a while, outputs")
    parser.add_argument("--decimate", type=split_words, default=[], metavar="T,T", help="thresholds [none: no flag]")
    parser.add_argument("--depth", type=int, default=9)
    parser.add_argument("--max-memory", default="256MiB")
    parser.add_argument("--brickmend", default="target/release/brickmend", metavar="BIN")
    parser.add_argument("--judge", metavar="COMMAND")
    parser.add_argument("--judge-jobs", type=int, default=os.cpu_count(), metavar="N", help="[one per core]")
    parser.add_argument("--chosen", type=split_words, default=[], metavar="NAME,NAME", help="parts of names")
    parser.add_argument("--field", action="append", default=[], metavar="NAME=PATH")
    parser.add_argument("--only", default="", help="models whose path contains this")
    parser.add_argument("--format", default="ply", help="of the outputs [ply]")
    parser.add_argument("--timeout", type=float, default=3600, metavar="SECONDS", help="of one repair [3600]")
    parser.add_argument("--keep", action="store_true", help="keep the outputs, and what failed repairs leave")
    words = sys.argv[1:]
    split = words.index("--") if "--" in words else len(words)
    return parser, parser.parse_args(words[:split]), words[split + 1 :]


def main():
    parser, arguments, extra = parse()
    paths = measure.models_below(arguments.models, arguments.only)
    if not paths:
        parser.error(f"{arguments.models}: no model")
    root = arguments.models if arguments.models.is_dir() else arguments.models.parent
    models = [(str(path.relative_to(root)), path) for path in paths]
    arguments.out.mkdir(parents=True, exist_ok=True)
    sweep = Sweep(arguments, extra)
    sweep.run(models)
    rows = {name: sweep.rows[name] for name, _ in models}
    (arguments.out / "quality.md").write_text(page(sweep, rows, sweep.thresholds))
    done = [rows[name][threshold] for name in rows for threshold in sweep.thresholds]
    failed = [r for r in done if r["code"] not in (0, UNREADABLE) or r.get("judge", {}).get("valid") is False]
    sys.exit(1 if failed or any("failure" in r.get("judge", {}) for r in done) else 0)


if __name__ == "__main__":
    main()
