"""What the measuring scripts share: whole processes, repairs, the judge's word, tables.

Standard library only, so that the floor under every measured peak is that of a bare interpreter:
the kernel counts the memory that a process held before it became another program.
"""

import datetime
import json
import os
import pathlib
import platform
import shlex
import signal
import statistics
import subprocess
import tempfile
import threading
import time
from dataclasses import dataclass

MODEL_ENDINGS = {".obj", ".stl", ".ply", ".off", ".glb", ".gltf", ".3mf"}


@dataclass
class Run:
    """A process that has ended. `peak_bytes` is that of its largest process."""

    code: int
    wall_seconds: float
    cpu_seconds: float
    peak_bytes: int
    stdout: str
    stderr: str
    timed_out: bool = False

    def failure(self):
        """Why it failed, in a line; None if it did not."""
        if self.code == 0:
            return None
        lines = (self.stderr.strip() or self.stdout.strip()).splitlines()
        told = "took too long" if self.timed_out else (lines[-1] if lines else "no word")
        return f"exit {self.code}: {told[:200]}"


def run(command, timeout_seconds=None):
    """Runs a command to its end, or to its time limit; then its whole process group is killed."""
    with tempfile.TemporaryFile() as out, tempfile.TemporaryFile() as err:
        start = time.monotonic()
        try:
            process = subprocess.Popen(command, stdout=out, stderr=err, start_new_session=True)
        except OSError as error:
            return Run(127, 0.0, 0.0, 0, "", f"{command[0]}: {error.strerror}")
        late = threading.Event()

        def kill():
            late.set()
            os.killpg(process.pid, signal.SIGKILL)

        timer = threading.Timer(timeout_seconds, kill) if timeout_seconds else None
        if timer:
            timer.start()
        try:
            os.waitid(os.P_PID, process.pid, os.WEXITED | os.WNOWAIT)
        except BaseException:
            os.killpg(process.pid, signal.SIGKILL)
            raise
        finally:
            # Not reaped yet, so that the number still belongs to it.
            if timer:
                timer.cancel()
                timer.join()
            _, status, usage = os.wait4(process.pid, 0)
            process.returncode = os.waitstatus_to_exitcode(status)
        wall_seconds = time.monotonic() - start
        out.seek(0)
        err.seek(0)
        return Run(
            process.returncode,
            wall_seconds,
            usage.ru_utime + usage.ru_stime,
            usage.ru_maxrss * 1024,
            out.read().decode(errors="replace"),
            err.read().decode(errors="replace"),
            late.is_set(),
        )


def repair(binary, model, output, extra=(), timeout_seconds=None):
    """One repair; the run and, when it ended well, its outcome."""
    command = [binary, "repair", str(model), "-o", str(output), "--json", *extra]
    ended = run(command, timeout_seconds)
    return ended, json.loads(ended.stdout) if ended.code == 0 else None


def models_below(folder, only=""):
    """Model files below a folder (or the file itself) whose path contains `only`, sorted."""
    found = [folder] if folder.is_file() else folder.rglob("*")
    return sorted(p for p in found if p.suffix.lower() in MODEL_ENDINGS and only in str(p))


def judge(command, output, reference=None, timeout_seconds=None):
    """What a judge says of a mesh: a flat dictionary, or {"failure": why}.

    The judge is any command that takes `check MESH --json [--input REFERENCE]` and prints an
    object with `as_written` or `welded` (edge and vertex counts), `self_intersections.pairs`,
    `orientation.ok`, `verdict.valid` and, with a reference, `input` (distances as shares of its
    `diagonal`). `distance` adds --no-intersections.
    """
    arguments = ["check", str(output), "--json"]
    if reference:
        arguments += ["--input", str(reference)]
    ended = run([*shlex.split(command), *arguments], timeout_seconds)
    if ended.code != 0:
        return {"failure": ended.failure()}
    told = json.loads(ended.stdout)
    topology = told["as_written"] or told["welded"]
    words = {
        "triangles": topology["triangles"],
        "boundary_edges": topology["boundary_edges"],
        "nonmanifold_edges": topology["nonmanifold_edges"],
        "nonmanifold_vertices": topology["nonmanifold_vertices"],
        "intersecting_pairs": told["self_intersections"]["pairs"],
        "outward": told["orientation"]["ok"],
        "valid": told["verdict"]["valid"],
    }
    if reference:
        against = told["input"]
        words["diagonal"] = against["diagonal"]
        words["hausdorff"] = against["hausdorff"]
        words["out_to_in"] = against["out_to_ref"]["max"]
        words["in_to_out"] = against["ref_to_out"]["max"]
        words["visible_in_to_out"] = against["visible"]["max"]
    return words


def distance(command, output, reference, timeout_seconds=None):
    """Largest distance between two meshes in model units by the same judge; None if it failed."""
    arguments = ["check", str(output), "--json", "--no-intersections", "--input", str(reference)]
    ended = run([*shlex.split(command), *arguments], timeout_seconds)
    against = json.loads(ended.stdout)["input"] if ended.code == 0 else None
    return against and against["hausdorff"] * against["diagonal"]


def table(head, rows):
    """A markdown table."""
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join("| " + " | ".join(str(cell) for cell in line) + " |" for line in lines) + "\n"


def short(value, digits=3):
    """A number with some significant digits, without an exponent; "" for None."""
    if value is None:
        return ""
    if isinstance(value, int):
        return f"{value:,}".replace(",", " ")
    if abs(value) >= 10 ** (digits - 1):
        return f"{value:.0f}"
    return f"{value:#.{digits}g}" if abs(value) >= 1e-4 or value == 0 else f"{value:.{digits - 1}e}"


def median(values):
    """The median; None of nothing."""
    return statistics.median(values) if values else None


def dig(tree, path):
    """The value at a dotted path, None if there is none."""
    for name in path.split("."):
        tree = tree.get(name) if isinstance(tree, dict) else None
    return tree


def machine():
    """The machine, the date and how busy it is, by name."""
    cpu, memory_kib = platform.machine(), 0
    for line in pathlib.Path("/proc/cpuinfo").read_text().splitlines():
        if line.startswith("model name"):
            cpu = line.split(":", 1)[1].strip()
    for line in pathlib.Path("/proc/meminfo").read_text().splitlines():
        if line.startswith("MemTotal"):
            memory_kib = int(line.split()[1])
    return {
        "date": datetime.datetime.now(datetime.timezone.utc).strftime("%Y-%m-%d %H:%M UTC"),
        "machine": f"{cpu}, {os.cpu_count()} cores, {memory_kib / 2**20:.0f} GiB",
        "system": f"{platform.system()} {platform.release()}",
        "load": os.getloadavg()[0],
    }
