#!/usr/bin/env python3
"""Runs a command and tells what all its processes together held at most.

    scripts/watch_tree.py [--interval SECONDS] [--json FILE] -- COMMAND...

Every process that descends from the command is sampled (/proc/PID/smaps_rollup): resident bytes, in
which shared pages count once for each process, and proportional bytes, in which they count once.
What is shorter than the interval may be missed.

exit status: that of the command
"""

import argparse
import json
import pathlib
import subprocess
import sys
import time


def parents():
    """By process its parent."""
    found = {}
    for entry in pathlib.Path("/proc").iterdir():
        if entry.name.isdigit():
            try:
                stat = (entry / "stat").read_text()
            except OSError:
                continue
            found[int(entry.name)] = int(stat.rpartition(")")[2].split()[1])
    return found


def tree(root):
    """All processes that descend from `root`, itself included."""
    of, members = parents(), {root}
    grown = True
    while grown:
        more = {pid for pid, parent in of.items() if parent in members} - members
        members |= more
        grown = bool(more)
    return members


def held(pid):
    """Resident and proportional bytes of a process; none of one that has gone."""
    try:
        text = pathlib.Path(f"/proc/{pid}/smaps_rollup").read_text()
    except OSError:
        return 0, 0
    sizes = {line.split()[0]: line.split()[1] for line in text.splitlines()[1:]}
    return int(sizes.get("Rss:", 0)) * 1024, int(sizes.get("Pss:", 0)) * 1024


def main():
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--interval", type=float, default=0.05)
    options.add_argument("--json", type=pathlib.Path)
    options.add_argument("command", nargs=argparse.REMAINDER)
    asked = options.parse_args()
    command = asked.command[asked.command[:1] == ["--"] :]
    if not command:
        options.error("no command")
    begun = time.monotonic()
    process = subprocess.Popen(command)
    peak = {"resident_bytes": 0, "proportional_bytes": 0, "processes": 0, "samples": 0}
    while process.poll() is None:
        members = tree(process.pid)
        sizes = [held(pid) for pid in members]
        for at, name in enumerate(["resident_bytes", "proportional_bytes"]):
            peak[name] = max(peak[name], sum(size[at] for size in sizes))
        peak["processes"] = max(peak["processes"], len(members))
        peak["samples"] += 1
        time.sleep(asked.interval)
    peak["seconds"] = round(time.monotonic() - begun, 2)
    mib = {name: peak[name] / 2**20 for name in ["resident_bytes", "proportional_bytes"]}
    print(
        f"{peak['seconds']} s, at most {mib['resident_bytes']:.0f} MiB resident, "
        f"{mib['proportional_bytes']:.0f} MiB proportional, {peak['processes']} processes",
        file=sys.stderr,
    )
    if asked.json:
        asked.json.write_text(json.dumps(peak, indent=2) + "\n")
    return process.returncode


if __name__ == "__main__":
    sys.exit(main())
