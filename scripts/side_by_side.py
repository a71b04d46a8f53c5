#!/usr/bin/env python3
"""Draws meshes of the same part side by side, shaded, with edges, close-ups below.

    scripts/side_by_side.py SHEET.png [CAPTION=]MESH... [--view 30,25] [--up z]
        [--box LO:HI]... [--cut] [--no-whole] [--width 640] [--columns N] [--no-edges] [--both-sides]

All pictures have the same camera and frame: parallel projection, the viewer at 30 degrees to the
right of the front (-y) and 25 above it. Faces seen from behind are red. Edges are those of the
file: cuts through quads are not drawn. Where triangles are smaller than a few pixels, edges fade.

--box X,Y,Z:X,Y,Z adds a close-up of a box, in model units, or in % of the first mesh's bounding box
(`--box 40%,0%,90%:60%,10%,100%`). The box is outlined in the whole picture. --cut leaves out what
lies wholly before the box. Needs numpy; reads PLY, STL, OBJ and OFF.
"""

import argparse
import math
import os

try:
    import numpy as np
except ImportError:
    raise SystemExit("side_by_side.py needs numpy") from None

import contact_sheet
import measure
import mesh_files

OVERSAMPLING = 3
PAPER = np.array([1.0, 1.0, 1.0])
FRONT = np.array([0.83, 0.85, 0.87])
BACK = np.array([0.85, 0.25, 0.20])
INK = np.array([0.10, 0.12, 0.16])
FRAME = np.array([0.80, 0.10, 0.45])
# Towards the lamps, in the viewer's axes: right, up, nearer. The last number is the strength.
LAMPS = [(-0.45, 0.65, 0.60, 0.50), (0.85, 0.15, 0.50, 0.32)]
AMBIENT = 0.30
# Samples that are looked at in one go, for triangles with boxes of about the same size.
BATCH = 1 << 22


def axes_of(view, up):
    """Rows: right, up, nearer. A turn, so that shapes are not mirrored."""
    azimuth, elevation = (math.radians(angle) for angle in view)
    nearer = np.array([
        math.sin(azimuth) * math.cos(elevation), -math.cos(azimuth) * math.cos(elevation), math.sin(elevation),
    ])
    right = np.array([math.cos(azimuth), math.sin(azimuth), 0.0])
    rows = np.stack([right, np.cross(nearer, right), nearer])
    # With y up, the front is +z: (x, y, z) is seen as (x, -z, y).
    return rows if up == "z" else rows @ np.array([[1, 0, 0], [0, 0, -1], [0, 1, 0]])


def box_corners(lo, hi):
    """The eight corners of a box."""
    return np.array([[(lo, hi)[i >> k & 1][k] for k in range(3)] for i in range(8)])


class Camera:
    """Brings model space to samples: x to the right, y down, z nearer."""

    def __init__(self, axes, corners, width, margin=0.04, height=None):
        self.axes = axes
        seen = corners @ axes.T
        lo, hi = seen.min(axis=0), seen.max(axis=0)
        size = np.maximum(hi - lo, 1e-12 * np.abs(seen).max())[:2] * (1 + 2 * margin)
        if height is None:
            height = round(width * min(1.4, max(0.4, size[1] / size[0])))
        self.width, self.height = width, height
        self.scale = min(width / size[0], height / size[1])
        self.middle, self.near = (lo + hi)[:2] / 2, hi[2]

    def samples(self, points):
        """Points to sample positions and depth."""
        seen = points @ self.axes.T
        scale = self.scale * OVERSAMPLING
        x = (seen[..., 0] - self.middle[0]) * scale + self.width * OVERSAMPLING / 2
        y = (self.middle[1] - seen[..., 1]) * scale + self.height * OVERSAMPLING / 2
        return np.stack([x, y, seen[..., 2] * scale], axis=-1)


def visible(corners, width, height):
    """The number of the nearest triangle at every sample, -1 for none."""
    lo = np.ceil(corners[:, :, :2].min(axis=1) - 0.5).astype(np.int64)
    hi = np.floor(corners[:, :, :2].max(axis=1) - 0.5).astype(np.int64)
    lo = np.maximum(lo, 0)
    hi = np.minimum(hi, [width - 1, height - 1])
    span = hi - lo + 1
    shown = np.flatnonzero((span > 0).all(axis=1))
    if not len(shown):
        return np.full(width * height, -1)
    depth = corners[:, :, 2]
    nearest, farthest = depth[shown].max(), depth[shown].min()
    steps = (2**31 - 2) / max(nearest - farthest, 1e-9)
    # Depth above, number below: the largest is the nearest.
    buffer = np.zeros(width * height, np.uint64)
    classes = np.ceil(np.log2(span[shown])).astype(np.int64)
    for kind in np.unique(classes, axis=0):
        columns, lines = 1 << kind
        same = shown[(classes == kind).all(axis=1)]
        chunk = max(1, BATCH // (columns * lines))
        for first in range(0, len(same), chunk):
            some = same[first : first + chunk]
            x = lo[some, 0, None, None] + np.arange(columns)[None, None, :]
            y = lo[some, 1, None, None] + np.arange(lines)[None, :, None]
            weights = np.stack([edge_side(corners[some], k, x + 0.5, y + 0.5) for k in range(3)])
            total = weights.sum(axis=0)
            inside = ((weights >= 0).all(axis=0) | (weights <= 0).all(axis=0)) & (total != 0)
            inside &= (x <= hi[some, 0, None, None]) & (y <= hi[some, 1, None, None])
            which, line, column = np.nonzero(inside)
            share = weights[:, which, line, column] / total[which, line, column]
            # The side of edge k belongs to the corner across from it.
            z = sum(share[k] * depth[some[which], (k + 2) % 3] for k in range(3))
            key = (np.clip((z - farthest) * steps, 0, 2**31 - 2).astype(np.uint64) + 1) << np.uint64(32)
            pixels = (lo[some[which], 1] + line) * width + lo[some[which], 0] + column
            np.maximum.at(buffer, pixels, key | some[which].astype(np.uint64))
    return np.where(buffer == 0, -1, (buffer & np.uint64(0xFFFFFFFF)).astype(np.int64))


def edge_side(corners, k, x, y):
    """Twice the area between an edge and a sample, with its sign."""
    a, b = (corners[:, i, :2].reshape(-1, 1, 1, 2) for i in (k, (k + 1) % 3))
    return (b[..., 0] - a[..., 0]) * (y - a[..., 1]) - (b[..., 1] - a[..., 1]) * (x - a[..., 0])


def shade(corners, inner, camera, edges, back):
    """Colours of all samples of a picture."""
    width, height = camera.width * OVERSAMPLING, camera.height * OVERSAMPLING
    numbers = visible(corners, width, height)
    picture = np.tile(PAPER, (width * height, 1))
    at = np.flatnonzero(numbers >= 0)
    seen, of_seen = np.unique(numbers[at], return_inverse=True)
    corners, inner = corners[seen], inner[seen]
    # y runs down in samples, so it is turned round for the normal.
    a, b, c = (corners[:, i] * [1, -1, 1] for i in range(3))
    normals = np.cross(b - a, c - a)
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-300)
    behind = normals[:, 2] < 0
    normals[behind] *= -1
    light = np.full(len(seen), AMBIENT)
    for *direction, strength in LAMPS:
        light += strength * np.maximum(0, normals @ (np.array(direction) / np.linalg.norm(direction)))
    picture[at] = (np.where(behind[:, None], back, FRONT) * light[:, None])[of_seen]
    if edges:
        ink = np.zeros(len(at))
        x, y = at % width + 0.5, at // width + 0.5
        for k in range(3):
            side = edge_side(corners[of_seen], k, x.reshape(-1, 1, 1), y.reshape(-1, 1, 1)).ravel()
            length = np.linalg.norm(corners[:, (k + 1) % 3, :2] - corners[:, k, :2], axis=1)[of_seen]
            distance = np.abs(side) / np.maximum(length, 1e-9) / OVERSAMPLING
            ink = np.maximum(ink, np.clip(1.1 - 1.4 * distance, 0, 1) * ~inner[of_seen, k])
        flat = edge_side(corners, 0, corners[:, 2, 0].reshape(-1, 1, 1), corners[:, 2, 1].reshape(-1, 1, 1))
        size = np.sqrt(np.abs(flat.ravel())) / OVERSAMPLING
        ink *= np.clip((size - 1) / 6, 0.12, 0.85)[of_seen]
        picture[at] = picture[at] * (1 - ink[:, None]) + INK * ink[:, None]
    return picture.reshape(height, width, 3)


def outline(picture, camera, corners):
    """Draws the rectangle round the projection of a box."""
    seen = camera.samples(corners)[:, :2]
    (x0, y0), (x1, y1) = seen.min(axis=0).astype(int), seen.max(axis=0).astype(int)
    height, width, _ = picture.shape
    x0, x1 = np.clip([x0, x1], 0, width - 1)
    y0, y1 = np.clip([y0, y1], 0, height - 1)
    pen = OVERSAMPLING * 2
    for rows, columns in (
        (slice(y0, y0 + pen), slice(x0, x1)), (slice(y1 - pen, y1), slice(x0, x1)),
        (slice(y0, y1), slice(x0, x0 + pen)), (slice(y0, y1), slice(x1 - pen, x1)),
    ):
        picture[rows, columns] = FRAME


def draw(mesh, camera, arguments, boxes=(), cut=False):
    """Rows of bytes of a picture."""
    corners, inner = mesh
    seen = camera.samples(corners)
    if cut:
        keep = seen[:, :, 2].min(axis=1) <= camera.near * camera.scale * OVERSAMPLING
        seen, inner = seen[keep], inner[keep]
    picture = shade(seen, inner, camera, arguments.edges, FRONT if arguments.both_sides else BACK)
    for box in boxes:
        outline(picture, camera, box)
    blocks = picture.reshape(camera.height, OVERSAMPLING, camera.width, OVERSAMPLING, 3).mean(axis=(1, 3))
    return [bytearray(row.tobytes()) for row in (np.clip(blocks, 0, 1) * 255 + 0.5).astype(np.uint8)]


def parse_box(text, lo, hi):
    """LO:HI in model units or % of a bounding box; its eight corners."""
    ends = []
    for end in text.split(":"):
        words = end.split(",")
        if len(words) != 3:
            raise ValueError(text)
        ends.append([
            lo[k] + float(w[:-1]) / 100 * (hi[k] - lo[k]) if w.endswith("%") else float(w)
            for k, w in enumerate(words)
        ])
    first, second = np.array(ends)
    return box_corners(np.minimum(first, second), np.maximum(first, second))


def parse():
    """The arguments."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter,
        usage="%(prog)s SHEET.png [CAPTION=]MESH... [options]",
    )
    parser.add_argument("sheet")
    parser.add_argument("meshes", nargs="+", metavar="[CAPTION=]MESH")
    parser.add_argument("--view", default="30,25", metavar="AZIMUTH,ELEVATION", help="degrees [30,25]")
    parser.add_argument("--up", choices=["y", "z"], default="z", help="the model's upward axis [z]")
    parser.add_argument("--box", action="append", default=[], metavar="LO:HI", help="a close-up; may be repeated")
    parser.add_argument("--cut", action="store_true", help="close-ups without what lies before the box")
    parser.add_argument("--no-whole", dest="whole", action="store_false", help="close-ups only")
    parser.add_argument("--both-sides", action="store_true", help="backs are drawn like fronts")
    parser.add_argument("--no-edges", dest="edges", action="store_false")
    parser.add_argument("--width", type=int, default=640, help="of a picture, in pixels [640]")
    parser.add_argument("--columns", type=int, default=4, help="pictures in a row, at most [4]")
    arguments = parser.parse_args()
    try:
        arguments.view = [float(word) for word in arguments.view.split(",")]
        azimuth, elevation = arguments.view
    except ValueError:
        parser.error("--view takes two numbers: AZIMUTH,ELEVATION")
    if arguments.width < 16 or arguments.columns < 1 or not (arguments.whole or arguments.box):
        parser.error("--width starts at 16, --columns at 1, and --no-whole needs a --box")
    return parser, arguments


def main():
    parser, arguments = parse()
    named = [name.rpartition("=")[::2] for name in arguments.meshes]
    meshes = [mesh_files.read(path) for _, path in named]
    for (_, path), (corners, _) in zip(named, meshes):
        if not len(corners) or not np.isfinite(corners).all():
            parser.error(f"{path}: no triangle, or a corner that is not finite")
    bounds = [(corners.min(axis=(0, 1)), corners.max(axis=(0, 1))) for corners, _ in meshes]
    try:
        boxes = [parse_box(text, *bounds[0]) for text in arguments.box]
    except ValueError:
        parser.error("--box takes two corners: X,Y,Z:X,Y,Z")
    axes = axes_of(arguments.view, arguments.up)
    everything = box_corners(np.min([lo for lo, _ in bounds], axis=0), np.max([hi for _, hi in bounds], axis=0))
    cells = []
    for (caption, path), mesh in zip(named, meshes):
        caption = caption or os.path.splitext(os.path.basename(path))[0]
        faces = len(mesh[0]) - int(mesh[1].sum()) // 2
        rows = contact_sheet.label_rows(caption, arguments.width)
        rows += contact_sheet.label_rows(f"{measure.short(faces)} faces", arguments.width)
        if arguments.whole:
            rows += draw(mesh, Camera(axes, everything, arguments.width), arguments, boxes)
        for box in boxes:
            camera = Camera(axes, box, arguments.width, margin=0)
            rows += contact_sheet.label_rows("", arguments.width)[: contact_sheet.MARGIN]
            rows += draw(mesh, camera, arguments, cut=arguments.cut)
        cells.append((arguments.width, rows))
    contact_sheet.write_png(arguments.sheet, *contact_sheet.join(cells, arguments.columns))


if __name__ == "__main__":
    main()
