#!/usr/bin/env python3
"""Measures brickmend beside its peers: the same mesh, the same cell, in turns, whole processes.

    scripts/bench_peers.py MESH.stl [--depths 8-11] [--rounds 3] [--brickmend BIN]
        [--blender PYTHON] [--vdb-tool BIN] [--peer 'NAME=COMMAND']... [--variant 'NAME=ARGS']...
        [--judge COMMAND] [--out docs/benchmarks] [--work DIR]

Peers, each left out with a word if it is not there:
  Blender   Remesh modifier, mode SHARP (PolyMender's code); PYTHON is an interpreter with `bpy`
            (pip install bpy). Its start alone is measured as well and told apart.
  OpenVDB   `vdb_tool` (Debian: libopenvdb-tools), mesh to level set to mesh, no adaptivity. It
            reads binary STL, so that is what MESH has to be.
  --peer    any other: COMMAND with {in} {out} {cell} {depth} {scale}; writes PLY.

From file to file: processor seconds (user and system), wall time and peak memory are the kernel's
(wait4). Every round runs each program once, in turning order; medians are told. brickmend's proof
and measuring, which no peer has, are on its clock and told apart (its own stage timings). Seconds per million leaf
cells use brickmend's count of leaf cells for all, since mesh and cell are the same. --judge is run
on every output of the first round, up to --judge-depth: see `judge` in measure.py.

Written to --out after every depth: peers.md (tables) and peers.json (every run); at the end
peers.svg (plot) if matplotlib is there.

exit status: 0 measured, 1 a run failed, 2 usage or no brickmend, 3 no peer is there
"""

import argparse
import json
import pathlib
import shlex
import shutil
import struct
import sys
import tempfile

import measure
import peers_page

START = "Blender's start"


class Brickmend:
    """The program itself, perhaps with more arguments."""

    kind, starts = "own", False

    def __init__(self, binary, name, arguments, memory):
        self.binary, self.name, self.arguments, self.memory = binary, name, arguments, memory

    def version(self):
        told = measure.run([self.binary, "--version"])
        return told.stdout.strip() if told.code == 0 else None

    def command(self, mesh, output, depth, _grid):
        memory = ["--max-memory", self.memory, "--fresh", "--json"]
        return [self.binary, "repair", mesh, "-o", output, "--depth", str(depth), *memory, *self.arguments]

    def parts(self, run):
        """CPU seconds of the stages, and what the others have to know of the grid."""
        outcome = json.loads(run.stdout)
        seconds = {name: stage["cpu_seconds"] for name, stage in outcome["stages"].items()}
        grid = {"cell": outcome["cell_size"], "leaf_cells": outcome["scan"]["leaf_cells"]}
        grid["budget_bytes"] = outcome["memory"]["budget_bytes"]
        bounds = outcome["input"]["bounds"]
        grid["extent"] = max(hi - lo for lo, hi in zip(bounds["lo"], bounds["hi"]))
        grid["input_triangles"] = outcome["input"]["triangles"]
        return {"parts": seconds, "grid": grid}


class Blender:
    """Blender's Remesh modifier in another interpreter; `start_only` measures its start."""

    def __init__(self, python, start_only=False):
        self.python, self.start_only = python, start_only
        self.kind = "start" if start_only else "peer"
        self.starts = not start_only
        self.name = START if start_only else "Blender SHARP"
        self.script = str(pathlib.Path(__file__).with_name("remesh_with_blender.py"))

    def version(self):
        told = measure.run([self.python, self.script])
        return "bpy " + last_object(told.stdout)["version"] if told.code == 0 else None

    def command(self, mesh, output, depth, grid):
        if self.start_only:
            return [self.python, self.script]
        scale = grid["extent"] / (grid["cell"] * 2**depth)
        return [self.python, self.script, mesh, output, str(depth), repr(scale)]

    def parts(self, run):
        return {"parts": last_object(run.stdout)["cpu_seconds"]}


class OpenVdb:
    """vdb_tool: a narrow band of three cells, then its dual contouring without adaptivity."""

    name, kind, starts = "OpenVDB", "peer", False

    def __init__(self, binary):
        self.binary = binary

    def version(self):
        told = measure.run([self.binary, "-version"])
        return told.stdout.strip() or told.stderr.strip() if told.code == 0 else None

    def command(self, mesh, output, _depth, grid):
        steps = ["-mesh2ls", f"voxel={grid['cell']!r}", "width=3", "-ls2mesh", "adapt=0"]
        return [self.binary, "-read", mesh, *steps, "-write", output]

    def parts(self, _run):
        return {}


class Other:
    """A peer given as a command."""

    kind, starts = "peer", False

    def __init__(self, name, template):
        self.name, self.template = name, template

    def version(self):
        found = shutil.which(shlex.split(self.template)[0])
        return "version not asked" if found else None

    def command(self, mesh, output, depth, grid):
        words = {"in": mesh, "out": output, "depth": depth, "cell": repr(grid["cell"])}
        words["scale"] = repr(grid["extent"] / (grid["cell"] * 2**depth))
        return [part.format(**words) for part in shlex.split(self.template)]

    def parts(self, _run):
        return {}


def last_object(text):
    """The JSON object on the last line that has one."""
    return json.loads([line for line in text.splitlines() if line.startswith("{")][-1])


def check_stl(path):
    """None, or why the file is no binary STL."""
    try:
        size = path.stat().st_size
        with path.open("rb") as file:
            head = file.read(84)
    except OSError as error:
        return f"{path}: {error.strerror}"
    if len(head) < 84 or 84 + 50 * struct.unpack("<I", head[80:])[0] != size:
        return f"{path}: not a binary STL, which all peers read"
    return None


def header_faces(path):
    """The number of faces that a PLY header tells."""
    with path.open("rb") as file:
        for line in file.read(4096).split(b"\n"):
            if line.startswith(b"element face "):
                return int(line.split()[2])
    return None


def parse_depths(text):
    """8-11 or 8,9,12."""
    depths = []
    for part in text.split(","):
        first, _, last = part.partition("-")
        depths += range(int(first), int(last or first) + 1)
    return depths


class Bench:
    """Runs everything and remembers it: `records` has one entry per run."""

    def __init__(self, arguments, tools):
        self.arguments, self.tools = arguments, tools
        self.records, self.verdicts, self.failed = [], [], False
        self.start = measure.machine()
        self.floor_bytes = measure.run(["true"]).peak_bytes
        self.versions, self.plotted = {}, False

    def depth(self, depth, work):
        """All rounds at one depth."""
        once = self.arguments.once_from and depth >= self.arguments.once_from
        grid, tools = None, list(self.tools)
        for turn in range(1 if once else self.arguments.rounds):
            at = turn % len(tools)
            for tool in tools[at:] + tools[:at]:
                output = pathlib.Path(work) / f"{self.tools.index(tool)}.ply"
                record = self.once(tool, depth, grid, output)
                grid = grid or record.get("grid")
                if grid is None:
                    return print(f"depth {depth}: no cell size, {tool.name} failed", flush=True)
                if turn == 0 and output.exists():
                    self.judge(tool, depth, output)
                output.unlink(missing_ok=True)
                if record["failure"]:
                    # Once is enough to know.
                    tools.remove(tool)
        return None

    def once(self, tool, depth, grid, output):
        """One run of one program."""
        mesh = str(self.arguments.mesh)
        command = tool.command(mesh, str(output), depth, grid)
        run = measure.run(command, self.arguments.timeout)
        failure = run.failure()
        if not failure and tool.kind != "start" and not output.exists():
            failure = "no output"
        # The page tells names, not places.
        failure = failure and failure.replace(str(self.arguments.mesh), self.arguments.mesh.name)
        record = {
            "depth": depth, "tool": tool.name, "failure": failure, "cpu_seconds": run.cpu_seconds,
            "wall_seconds": run.wall_seconds, "peak_bytes": run.peak_bytes,
        }
        if not failure:
            record |= tool.parts(run)
        if output.exists():
            record |= {"faces": header_faces(output), "output_bytes": output.stat().st_size}
        self.failed |= bool(failure)
        self.records.append(record)
        told = f"{run.cpu_seconds:.2f} CPU s, {run.wall_seconds:.2f} s, {run.peak_bytes / 2**20:.0f} MiB"
        print(f"depth {depth}, {tool.name}: {failure or told}", flush=True)
        return record

    def judge(self, tool, depth, output):
        """Asks the judge, if there is one and the output is not too large for it."""
        if not self.arguments.judge or depth > self.arguments.judge_depth:
            return
        words = measure.judge(self.arguments.judge, output)
        print(f"    {words}", flush=True)
        self.verdicts.append({"depth": depth, "tool": tool.name, **words})

    def of(self, depth, name):
        """The runs of a program at a depth that went well."""
        found = [r for r in self.records if (r["depth"], r["tool"]) == (depth, name)]
        return [r for r in found if not r["failure"]]

    def middle(self, depth, name, value):
        """The median of a figure over these runs; None if there is no run."""
        return measure.median([value(record) for record in self.of(depth, name)])

    def cpu(self, depth, name):
        return self.middle(depth, name, lambda r: r["cpu_seconds"])

    def without_checks(self, depth, name):
        """CPU seconds of brickmend less those of its proof and of measuring how far it lies off."""
        checks = ("verify", "deviate")
        return self.middle(depth, name, lambda r: r["cpu_seconds"] - sum(r["parts"][c] for c in checks))

    def without_start(self, depth, name):
        """CPU seconds of Blender less those of its start; of others, all of them."""
        start = self.cpu(depth, START) if any(t.starts and t.name == name for t in self.tools) else 0.0
        whole = self.cpu(depth, name)
        return None if whole is None or start is None else whole - start

    def depths(self):
        return sorted({record["depth"] for record in self.records})

    def grid(self, depth):
        return next((r["grid"] for r in self.records if r["depth"] == depth and "grid" in r), {})


def save(bench):
    """Page and raw figures."""
    out = bench.arguments.out
    out.mkdir(parents=True, exist_ok=True)
    raw = {**bench.start, "versions": bench.versions, "mesh": bench.arguments.mesh.name}
    raw |= {"max_memory": bench.arguments.max_memory, "runs": bench.records, "verdicts": bench.verdicts}
    (out / "peers.json").write_text(json.dumps(raw, indent=1) + "\n")
    (out / "peers.md").write_text(peers_page.page(bench))


def present(arguments):
    """The programs that are there; a line for each that is not."""
    named = [word.partition("=") for word in arguments.variant] or [("", "", "")]
    tools = [
        Brickmend(arguments.brickmend, f"brickmend {name}".strip(), shlex.split(words), arguments.max_memory)
        for name, _, words in named
    ]
    tools += [Blender(arguments.blender, start_only=True), Blender(arguments.blender)]
    tools.append(OpenVdb(arguments.vdb_tool))
    tools += [Other(name, command) for name, _, command in (p.partition("=") for p in arguments.peer)]
    found, versions = [], {}
    for tool in tools:
        version = tool.version()
        if version is None:
            print(f"{tool.name}: not here, left out", flush=True)
            continue
        found.append(tool)
        if tool.kind != "start":
            versions[tool.name] = version
            print(f"{tool.name}: {version}", flush=True)
    return found, versions


def parse():
    """The arguments."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter,
        usage="%(prog)s MESH.stl [options]",
    )
    parser.add_argument("mesh", type=pathlib.Path, help="binary STL")
    parser.add_argument("--depths", type=parse_depths, default=[8, 9, 10, 11], metavar="D-D,D")
    parser.add_argument("--rounds", type=int, default=3, help="runs of each program at each depth [3]")
    parser.add_argument("--once-from", type=int, metavar="D", help="one round only from this depth on")
    parser.add_argument("--brickmend", default="target/release/brickmend", metavar="BIN")
    parser.add_argument("--max-memory", default="256MiB", help="what brickmend is granted [256MiB]")
    parser.add_argument(
        "--variant", action="append", default=[], metavar="NAME=ARGS",
        help="brickmend with these arguments; may be repeated, the first one is compared [none]",
    )
    parser.add_argument("--blender", default=sys.executable, metavar="PYTHON", help="interpreter with bpy [this one]")
    parser.add_argument("--vdb-tool", default="vdb_tool", metavar="BIN")
    parser.add_argument("--peer", action="append", default=[], metavar="NAME=COMMAND", help="another peer")
    parser.add_argument("--judge", metavar="COMMAND", help="counts defects of the outputs")
    parser.add_argument("--judge-depth", type=int, default=10, metavar="D", help="deepest that is judged [10]")
    parser.add_argument("--timeout", type=float, default=3600, metavar="SECONDS", help="of one run [3600]")
    parser.add_argument("--out", type=pathlib.Path, default=pathlib.Path("docs/benchmarks"), metavar="DIR")
    parser.add_argument("--work", metavar="DIR", help="where outputs lie for a moment [system's]")
    return parser, parser.parse_args()


def main():
    parser, arguments = parse()
    complaint = check_stl(arguments.mesh)
    if complaint or arguments.rounds < 1:
        parser.error(complaint or "--rounds starts at 1")
    tools, versions = present(arguments)
    if not tools or tools[0].kind != "own":
        parser.error(f"{arguments.brickmend}: no brickmend there, and it sets the cell")
    bench = Bench(arguments, tools)
    bench.versions = versions
    with tempfile.TemporaryDirectory(dir=arguments.work) as work:
        for depth in arguments.depths:
            bench.depth(depth, work)
            save(bench)
    # Only now: matplotlib's memory would be a floor under every later peak.
    bench.plotted = peers_page.plot(bench, arguments.out / "peers.svg")
    save(bench)
    if not any(tool.kind == "peer" for tool in tools):
        print("no peer is there: nothing to compare with", flush=True)
        sys.exit(3)
    sys.exit(1 if bench.failed else 0)


if __name__ == "__main__":
    main()
