#!/usr/bin/env python3
"""Holds GLB files against the validator of Khronos.

    scripts/validate_glb.py FILE...  [--modules FOLDER]

Needs node and the npm package gltf-validator: from FOLDER/node_modules, where npm puts it if it is
missing (default: ~/.cache/brickmend-gltf). Tells errors and warnings of every file; hints and
informations are counted.

exit status: 0 no errors, 1 errors, 2 no validator
"""

import argparse
import json
import pathlib
import shutil
import subprocess
import sys

VALIDATE = """
const validator = require('gltf-validator');
const bytes = new Uint8Array(require('fs').readFileSync(process.argv[1]));
validator.validateBytes(bytes, {maxIssues: 0})
  .then(report => console.log(JSON.stringify(report)))
  .catch(error => { console.error(String(error)); process.exit(1); });
"""
SEVERITIES = ["error", "warning"]


def modules(folder):
    """The folder with the validator in it, installed if need be; None without node or network."""
    if not shutil.which("node"):
        return None
    folder = folder.expanduser()
    if not (folder / "node_modules/gltf-validator").is_dir():
        folder.mkdir(parents=True, exist_ok=True)
        command = ["npm", "install", "--silent", "--prefix", folder, "gltf-validator"]
        if not shutil.which("npm") or subprocess.run(command).returncode:
            return None
    return folder


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("files", nargs="+", type=pathlib.Path)
    parser.add_argument("--modules", type=pathlib.Path, default="~/.cache/brickmend-gltf")
    arguments = parser.parse_args()
    folder = modules(arguments.modules)
    if not folder:
        print("gltf-validator cannot be had: no node, no npm or no network", file=sys.stderr)
        return 2
    errors = 0
    for file in arguments.files:
        command = ["node", "-e", VALIDATE, file.resolve()]
        run = subprocess.run(command, cwd=folder, capture_output=True, text=True)
        if run.returncode:
            print(f"{file}: {run.stderr.strip()}")
            errors += 1
            continue
        issues = json.loads(run.stdout)["issues"]
        errors += issues["numErrors"]
        counts = ["numErrors", "numWarnings", "numInfos", "numHints"]
        print(f"{file}: " + ", ".join(f"{issues[count]} {count[3:].lower()}" for count in counts))
        for message in issues["messages"]:
            if message["severity"] < len(SEVERITIES):
                place = message.get("pointer", message.get("offset", ""))
                print(f"  {SEVERITIES[message['severity']]} {place}: {message['message']}")
    return 1 if errors else 0


if __name__ == "__main__":
    sys.exit(main())
