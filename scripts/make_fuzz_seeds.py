#!/usr/bin/env python3
"""Writes the seeds that the corpora in testdata/fuzz/ grow from.

    scripts/make_fuzz_seeds.py [--brickmend BIN]

Small files of every format by hand, and records of bricks and manifests taken from the work folder
of a run that is killed on its way.
"""

import argparse
import gzip
import pathlib
import struct
import subprocess
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parent.parent
FUZZ = ROOT / "testdata" / "fuzz"

OBJ = {
    "materials_and_groups": b"# x\nmtllib a.mtl\no p\nv 0 0 0 1 0 0\nv 4 0 0\nv 1 1 0\nv 0 4 0\nvt 0 1\n"
    b"usemtl m\nf 1/1 2/1 3/1 \\\n4/1\ng q\nf -1 -2 -3\n",
    "wild_and_strange": b"v nan inf 1e999\nv 1 2\nv 1 2 3 4 5 6\nf 1 2 4000000000\nf 1 2\nf 0 1 2\nl 1 2\n",
    "concave": b"v 0 0 0\nv 4 0 0\nv 4 4 0\nv 2 1 0\nv 0 4 0\nf 1 2 3 4 5\n",
}
STL = {
    "text": b"solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1e0 0\n"
    b"endloop\nendfacet\nendsolid a\nsolid\nendsolid\n",
    "binary": b"x" * 80 + struct.pack("<I", 2) + struct.pack("<12fH", *range(12), 0) * 2,
    "binary_that_promises_more": b" " * 80 + b"\xff" * 4 + bytes(60),
}
PLY_HEAD = b"element vertex 3\nproperty float x\nproperty float y\nproperty double z\n"
PLY = {
    "text": b"ply\nformat ascii 1.0\ncomment c\n" + PLY_HEAD + b"property uchar red\n"
    b"element face 2\nproperty list uchar int vertex_indices\nend_header\n"
    b"0 0 0 9\n1 0 0 9\n0 1 0 9\n3 0 1 2\n3 2 1 7\n",
    "little": b"ply\nformat binary_little_endian 1.0\n" + PLY_HEAD
    + b"element face 1\nproperty list uchar uint vertex_indices\nend_header\n"
    + struct.pack("<ffd", 0, 0, 0) + struct.pack("<ffd", 1, 0, 0) + struct.pack("<ffd", 0, 1, 0)
    + struct.pack("<BIII", 3, 0, 1, 2),
    "big": b"ply\nformat binary_big_endian 1.0\nelement face 1\n"
    b"property list int short vertex_indices\n" + PLY_HEAD + b"end_header\n"
    + struct.pack(">ihhh", 3, 0, 1, 2)
    + struct.pack(">ffd", 0, 0, 0) + struct.pack(">ffd", 1, 0, 0) + struct.pack(">ffd", 0, 1, 0),
    "strips": b"ply\nformat ascii 1.0\n" + PLY_HEAD
    + b"element tristrips 1\nproperty list int int vertex_indices\nend_header\n"
    b"0 0 0\n1 0 0\n0 1 0\n5 0 1 2 -1 0\n",
}
OFF = {
    "colours": b"COFF # x\n5 3 0\n0 0 0 255 0 0 255\n4 0 0\n1 1 0\n0 4 0\n9 9 9\n"
    b"4 0 1 2 3 255 0 0\n3 0 1 4\n2 0 1\n",
    "counts_on_the_first_line": b"OFF 3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n",
}
MATERIALS = {
    "plain": b"newmtl m\nKd 0.1 0.2 0.3\nd 0.5\nTr 0.5\nmap_Kd a.png\nnewmtl n\nd -halo 0.3\n",
    "strange": b"Kd 1\nnewmtl\nKd x y z\nTr nan\nnewmtl m \\\n\nd 1e999\n",
}
SOUP = {
    "tetrahedron": bytes([0, 0, 0, 8, 0, 0, 0, 8, 0, 0, 0, 0, 0, 0, 8, 8, 0, 0] + [0, 0, 0, 0, 8, 0, 0, 0, 8]
    + [8, 0, 0, 0, 0, 8, 0, 8, 0]),
    "crossing_sheets": bytes([0, 0, 0, 64, 0, 0, 0, 64, 0, 0, 0, 0, 0, 64, 9, 64, 0, 250, 250, 3, 3, 40, 200, 7, 7, 9, 80]),
    "copies": bytes([0, 0, 0, 16, 0, 0, 0, 16, 0] * 3),
}


def write(target, files):
    """One file a seed."""
    folder = FUZZ / target
    folder.mkdir(parents=True, exist_ok=True)
    for name, content in files.items():
        (folder / f"seed_{name}").write_bytes(content)


def records(folder, name, most_bytes):
    """Short records of a brick file."""
    directory = (folder / f"{name}.directory").read_bytes()[64:]
    content = (folder / name).read_bytes()
    found = []
    for at in range(0, len(directory) - 39, 40):
        _, offset, length, _ = struct.unpack_from("<QQII", directory, at)
        if 0 < length <= most_bytes:
            found.append(content[offset : offset + length])
    return sorted(found, key=len)[:2]


def from_work_folders(brickmend):
    """Records and manifests that killed runs left, from later and later in the run."""
    bricks, manifests = {}, {}
    model = ROOT / "testdata" / "models" / "bowl.obj"
    with tempfile.TemporaryDirectory() as folder:
        output = pathlib.Path(folder) / "out.ply"
        work = pathlib.Path(folder) / "out.ply.brickmend"
        for delay_ms in range(2, 400, 2):
            command = [brickmend, "repair", str(model), "-o", str(output), "--depth", "8", "--fresh", "-q"]
            process = subprocess.Popen(command)
            time.sleep(delay_ms / 1000)
            process.kill()
            process.wait()
            if (work / "manifest").exists():
                manifest = (work / "manifest").read_bytes()
                manifests.setdefault(f"of_{len(manifest)}_bytes", manifest)
            for name in ("hits.bricks", "signs.bricks", "cells.bricks"):
                if (work / name).exists() and (work / f"{name}.directory").exists():
                    for number, record in enumerate(records(work, name, 2000)):
                        bricks[f"{name.split('.', maxsplit=1)[0]}_{number}"] = record
    write("bricks", bricks)
    write("manifest", dict(list(manifests.items())[:6]))


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("--brickmend", default=str(ROOT / "target" / "release" / "brickmend"))
    arguments = parser.parse_args()
    for target, files in (
        ("obj", OBJ), ("stl", STL), ("ply", PLY), ("off", OFF), ("materials", MATERIALS), ("soup", SOUP),
    ):
        write(target, files)
    every = {**OBJ, **STL, **PLY, **OFF}
    write("any", {**every, "packed": gzip.compress(OBJ["concave"], mtime=0)})
    from_work_folders(arguments.brickmend)


if __name__ == "__main__":
    main()
