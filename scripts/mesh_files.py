"""Reads meshes for drawing: PLY, STL, OBJ and OFF to loose triangles. Needs numpy.

`read` gives `corners` (triangles x 3 x 3) and `inner` (triangles x 3, true where the edge from a
corner to the next one is a cut through a polygon, so no edge of the file).
"""

import pathlib

import numpy as np

PLY_TYPES = {
    "char": "i1", "int8": "i1", "uchar": "u1", "uint8": "u1", "short": "i2", "int16": "i2",
    "ushort": "u2", "uint16": "u2", "int": "i4", "int32": "i4", "uint": "u4", "uint32": "u4",
    "float": "f4", "float32": "f4", "double": "f8", "float64": "f8",
}


def read(path):
    """Corners and inner edges of the triangles of a file."""
    path = pathlib.Path(path)
    content = path.read_bytes()
    readers = {".ply": read_ply, ".stl": read_stl, ".obj": read_obj, ".off": read_off}
    if path.suffix.lower() not in readers:
        raise SystemExit(f"{path}: not one of {', '.join(readers)}")
    vertices, polygons = readers[path.suffix.lower()](content)
    return cut(vertices, polygons)


def cut(vertices, polygons):
    """Fans of triangles; `polygons` are arrays of indices, one per number of corners."""
    corners, inner = [np.empty((0, 3, 3))], [np.empty((0, 3), bool)]
    for same in polygons:
        count = same.shape[1]
        for i in range(1, count - 1):
            corners.append(vertices[same[:, [0, i, i + 1]]])
            inner.append(np.tile([i > 1, False, i + 1 < count - 1], (len(same), 1)))
    return np.concatenate(corners), np.concatenate(inner)


def by_count(faces):
    """Lists of indices, grouped by their length."""
    groups = {}
    for face in faces:
        groups.setdefault(len(face), []).append(face)
    return [np.array(group, np.int64) for count, group in groups.items() if count >= 3]


def read_stl(content):
    """Binary or ASCII."""
    count = int.from_bytes(content[80:84], "little") if len(content) >= 84 else -1
    if 84 + 50 * count == len(content):
        layout = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("rest", "<u2")])
        vertices = np.frombuffer(content, layout, count, 84)["corners"].reshape(-1, 3)
    else:
        lines = (line.split() for line in content.decode(errors="replace").splitlines())
        vertices = np.array([w[1:4] for w in lines if w[:1] == ["vertex"]], float).reshape(-1, 3)
    return vertices.astype(float), [np.arange(len(vertices)).reshape(-1, 3)]


def read_obj(content):
    """Positions and faces only."""
    vertices, faces = [], []
    for line in content.decode(errors="replace").splitlines():
        words = line.split()
        if words[:1] == ["v"]:
            vertices.append(words[1:4])
        elif words[:1] == ["f"]:
            numbers = [int(word.split("/")[0]) for word in words[1:]]
            faces.append([n - 1 if n > 0 else len(vertices) + n for n in numbers])
    return np.array(vertices, float), by_count(faces)


def read_off(content):
    """Plain OFF, no colours."""
    text = "\n".join(line.split("#")[0] for line in content.decode(errors="replace").splitlines())
    words = text.split()
    at = 4 if words[0].upper().endswith("OFF") else 3
    vertex_count, face_count = int(words[at - 3]), int(words[at - 2])
    vertices = np.array(words[at : at + 3 * vertex_count], float).reshape(-1, 3)
    at += 3 * vertex_count
    faces = []
    for _ in range(face_count):
        count = int(words[at])
        faces.append([int(word) for word in words[at + 1 : at + 1 + count]])
        at += 1 + count
    return vertices, by_count(faces)


def read_ply(content):
    """ASCII or binary; the elements `vertex` and `face` in this order."""
    head, _, body = content.partition(b"end_header")
    body = body[body.index(b"\n") + 1 :]
    elements, order = [], "<"
    for words in (line.split() for line in head.decode(errors="replace").splitlines()):
        if words[:1] == ["element"]:
            elements.append((words[1], int(words[2]), []))
        elif words[:1] == ["property"]:
            elements[-1][2].append(words[1:])
        elif words[:1] == ["format"]:
            order = {"ascii": None, "binary_little_endian": "<", "binary_big_endian": ">"}[words[1]]
    if [name for name, _, _ in elements[:2]] != ["vertex", "face"]:
        raise SystemExit("PLY: vertices first, then faces, is all that is read")
    (_, vertex_count, columns), (_, face_count, lists) = elements[:2]
    names = [column[-1] for column in columns]
    axes = [names.index(axis) for axis in "xyz"]
    if order is None:
        lines = [line.split() for line in body.decode().splitlines() if line.strip()]
        vertices = np.array([[line[i] for i in axes] for line in lines[:vertex_count]], float)
        faces = [line[1 : 1 + int(line[0])] for line in lines[vertex_count : vertex_count + face_count]]
        return vertices, by_count([[int(word) for word in face] for face in faces])
    layout = np.dtype([(str(i), order + PLY_TYPES[c[0]]) for i, c in enumerate(columns)])
    table = np.frombuffer(body, layout, vertex_count)
    vertices = np.stack([table[str(i)].astype(float) for i in axes], axis=1)
    if len(lists) != 1:
        raise SystemExit("PLY: faces with more than a list of corners are not read")
    return vertices, binary_faces(body, layout.itemsize * vertex_count, face_count, lists[0], order)


def binary_faces(body, at, face_count, words, order):
    """Runs of faces with the same number of corners are read at one go."""
    count_type, index_type = (np.dtype(order + PLY_TYPES[word]) for word in words[1:3])
    groups, ahead = {}, 64
    while face_count:
        corners = int(np.frombuffer(body, count_type, 1, at)[0])
        layout = np.dtype([("count", count_type), ("corners", index_type, corners)])
        most = min(face_count, (len(body) - at) // layout.itemsize, ahead)
        run = np.frombuffer(body, layout, most, at)
        other = np.flatnonzero(run["count"] != corners)
        length = int(other[0]) if len(other) else most
        if length == 0:
            raise SystemExit("PLY: ends within a face")
        groups.setdefault(corners, []).append(run["corners"][:length].astype(np.int64))
        # Looks as far ahead as the last run suggests, so that mixed files stay fast.
        ahead = max(64, 4 * length)
        at += length * layout.itemsize
        face_count -= length
    return [np.concatenate(runs) for corners, runs in groups.items() if corners >= 3]
