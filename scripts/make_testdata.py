#!/usr/bin/env python3
"""Writes the models in testdata/: broken ones of our own making, small, the same on every run.

    python3 scripts/make_testdata.py            writes testdata/ beside this script's folder

Every folder of testdata/defects/ holds one smallest case: a model, and about.txt, whose first line
says what is wrong and whose second line says what must come out (see testdata/README.md).
Positions are rounded to six decimals, so that no libm reaches the files.
"""

import math
import struct
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent / "testdata"


# --- meshes: lists of triangles, a triangle is three points ------------------------------------

def quad(a, b, c, d):
    return [(a, b, c), (a, c, d)]


def panel(axis, at, u, v, up=True):
    """A rectangle normal to an axis: `u` and `v` are ascending breaks along the next two axes."""
    triangles = []
    for (u0, u1) in zip(u, u[1:]):
        for (v0, v1) in zip(v, v[1:]):
            corners = []
            for (a, b) in [(u0, v0), (u1, v0), (u1, v1), (u0, v1)]:
                point = [0.0, 0.0, 0.0]
                point[axis], point[(axis + 1) % 3], point[(axis + 2) % 3] = at, a, b
                corners.append(tuple(point))
            # Both sides are cut along the same diagonal, so that abutting faces match.
            triangles += quad(*corners) if up else flipped(quad(*corners))
    return triangles


def grid_box(x, y, z, without=()):
    """A box with all its faces cut at the breaks; `without` names sides such as (2, 1): z, high."""
    breaks = (x, y, z)
    triangles = []
    for axis in range(3):
        u, v = breaks[(axis + 1) % 3], breaks[(axis + 2) % 3]
        for high in (0, 1):
            if (axis, high) not in without:
                triangles += panel(axis, breaks[axis][-high], u, v, up=high == 1)
    return triangles


def box(lo, hi, without=()):
    return grid_box(*[(lo[a], hi[a]) for a in range(3)], without=without)


def flipped(triangles):
    return [(a, c, b) for (a, b, c) in triangles]


def sphere(radius, rings, sectors, first_ring=0, last_ring=None):
    """Rings count from the south pole; leaving rings out leaves a round opening."""
    last_ring = rings if last_ring is None else last_ring
    point = lambda i, j: (
        radius * math.sin(math.pi * i / rings) * math.cos(2 * math.pi * (j % sectors) / sectors),
        radius * math.sin(math.pi * i / rings) * math.sin(2 * math.pi * (j % sectors) / sectors),
        -radius * math.cos(math.pi * i / rings),
    )
    triangles = []
    for i in range(first_ring, last_ring):
        for j in range(sectors):
            a, b, c, d = point(i, j), point(i, j + 1), point(i + 1, j + 1), point(i + 1, j)
            if i > 0:
                triangles.append((a, b, c))
            if i < rings - 1:
                triangles.append((a, c, d))
    return triangles


def tube(centre, radius, lo, hi, sectors):
    """The side of an upright cylinder, open at both ends."""
    at = lambda j, z: (
        centre[0] + radius * math.cos(2 * math.pi * (j % sectors) / sectors),
        centre[1] + radius * math.sin(2 * math.pi * (j % sectors) / sectors),
        z,
    )
    return [t for j in range(sectors)
            for t in quad(at(j, lo), at(j + 1, lo), at(j + 1, hi), at(j, hi))]


# --- files ---------------------------------------------------------------------------------------

def number(x):
    if math.isnan(x):
        return "nan"
    text = f"{x:.6f}".rstrip("0").rstrip(".")
    return "0" if text == "-0" else text


def line_of(point):
    return " ".join(number(c) for c in point)


class Numbering:
    """Gives equal points one number."""

    def __init__(self, first):
        self.first, self.lines, self.number_of = first, [], {}

    def of(self, point):
        text = line_of(point)
        if text not in self.number_of:
            self.number_of[text] = self.first + len(self.lines)
            self.lines.append(text)
        return self.number_of[text]


def obj(triangles, comment, before="", after=""):
    numbering = Numbering(1)
    faces = [[numbering.of(p) for p in t] for t in triangles]
    lines = [f"# {comment}"] + [f"v {text}" for text in numbering.lines]
    lines += [before] if before else []
    lines += ["f {} {} {}".format(*face) for face in faces]
    lines += [after] if after else []
    return "\n".join(lines) + "\n"


def obj_of_parts(parts, comment, library):
    """`parts` are (name, material, triangles)."""
    numbering = Numbering(1)
    body = []
    for name, material, triangles in parts:
        body += [f"o {name}", f"usemtl {material}"]
        body += ["f {} {} {}".format(*[numbering.of(p) for p in t]) for t in triangles]
    head = [f"# {comment}", f"mtllib {library}"]
    return "\n".join(head + [f"v {text}" for text in numbering.lines] + body) + "\n"


def ply(triangles, comment):
    numbering = Numbering(0)
    faces = ["3 {} {} {}".format(*[numbering.of(p) for p in t]) for t in triangles]
    head = ["ply", "format ascii 1.0", f"comment {comment}",
            f"element vertex {len(numbering.lines)}",
            "property double x", "property double y", "property double z",
            f"element face {len(faces)}", "property list uchar int vertex_indices", "end_header"]
    return "\n".join(head + numbering.lines + faces) + "\n"


def off(triangles, comment):
    numbering = Numbering(0)
    faces = ["3 {} {} {}".format(*[numbering.of(p) for p in t]) for t in triangles]
    head = ["OFF", f"# {comment}", f"{len(numbering.lines)} {len(faces)} 0"]
    return "\n".join(head + numbering.lines + faces) + "\n"


def stl_text(triangles, name):
    lines = [f"solid {name}"]
    for triangle in triangles:
        lines += ["  facet normal 0 0 0", "    outer loop"]
        lines += [f"      vertex {line_of(p)}" for p in triangle]
        lines += ["    endloop", "  endfacet"]
    return "\n".join(lines + [f"endsolid {name}"]) + "\n"


def stl_bytes(triangles, name):
    out = name.encode().ljust(80, b"\0") + struct.pack("<I", len(triangles))
    for triangle in triangles:
        out += struct.pack("<12fH", 0, 0, 0, *[c for p in triangle for c in p], 0)
    return out


def write(path, content):
    path = ROOT / path
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(content.encode() if isinstance(content, str) else content)


def case(name, wrong, expected, content, file="model.obj"):
    write(f"defects/{name}/{file}", content)
    write(f"defects/{name}/about.txt", f"{wrong}\n{expected}\n")


# --- the models ----------------------------------------------------------------------------------

def cabinet():
    """A cabinet as catalogues have it: panels that overlap, and every careless defect."""
    w, d, h, t = 0.6, 0.4, 0.9, 0.025
    sides = box((0, 0, 0.1), (t, d, h)) + box((w - t, 0, 0.1), (w, d, h))
    # The right half of the sides was mirrored and never turned back.
    sides = sides[:12] + flipped(sides[12:])
    # The floor was exported twice, once per side.
    floor = box((0, 0, 0.1), (w, d, 0.1 + t))
    floor += flipped(floor)
    top = box((0, 0, h - t), (w, d, h))
    # Shelves run into the sides and the back.
    shelves = box((0.01, 0.01, 0.35), (w - 0.01, d - 0.02, 0.35 + t))
    shelves += flipped(box((0.01, 0.01, 0.6), (w - 0.01, d - 0.02, 0.6 + t)))
    # The back has a hole where a cable goes through, on its outer face only.
    breaks_x, breaks_z = (0, 0.25, 0.35, w), (0.1, 0.7, 0.8, h)
    back = grid_box(breaks_x, (d - t, d), breaks_z, without=[(1, 1)])
    outer = panel(1, d, breaks_z, breaks_x)
    in_hole = lambda tri: (all(0.7 - 1e-9 <= p[2] <= 0.8 + 1e-9 for p in tri)
                           and all(0.25 - 1e-9 <= p[0] <= 0.35 + 1e-9 for p in tri))
    back += [tri for tri in outer if not in_hole(tri)]
    # The door: front face cut in two rows, its neighbours in one, so four T-junctions.
    lo, hi = (0.002, -t, 0.1), (w - 0.002, 0, h)
    door = box(lo, hi, without=[(1, 0)])
    door += panel(1, lo[1], (lo[2], 0.5, hi[2]), (lo[0], 0.3, hi[0]), up=False)
    # The handle lacks the face that is hidden against the door; the pane is a glass sheet.
    handle = box((0.5, -t - 0.03, 0.45), (0.53, -t, 0.6), without=[(1, 1)])
    legs = []
    for x, y in [(0.06, 0.06), (w - 0.06, 0.06), (0.06, d - 0.06), (w - 0.06, d - 0.06)]:
        legs += tube((x, y), 0.03, 0.0, 0.11, 8)
    parts = [("sides", "oak", sides), ("floor", "oak", floor), ("top", "oak", top),
             ("shelves", "glass", shelves), ("back", "oak", back), ("door", "oak", door),
             ("handle", "steel", handle), ("legs", "steel", legs)]
    # OBJ files stand on y.
    upright = lambda tri: tuple((x, z, -y) for (x, y, z) in tri)
    parts = [(name, material, [upright(tri) for tri in tris]) for (name, material, tris) in parts]
    write("models/cabinet.obj", obj_of_parts(parts, "A careless cabinet, metres", "cabinet.mtl"))
    write("models/cabinet.mtl",
          "newmtl oak\nKd 0.66 0.5 0.32\nd 1\n\n"
          "newmtl steel\nKd 0.6 0.6 0.62\nd 1\n\n"
          "newmtl glass\nKd 0.8 0.9 0.9\nd 0.3\n")


def models():
    cabinet()
    bowl = sphere(0.1, 12, 16, last_ring=6)
    write("models/bowl.obj", obj(bowl, "An open bowl: one sheet with a rim, metres"))
    capless = sphere(1.0, 12, 16, last_ring=10)
    write("models/sphere_without_cap.ply", ply(capless, "A sphere, its north cap missing"))
    cube = box((0, 0, 0), (1, 1, 1))
    write("models/cube_binary.stl", stl_bytes(cube, "a closed cube"))
    write("models/cube_ascii.stl", stl_text(cube, "cube"))
    write("models/cube.off", off(cube, "a closed cube"))


def defects_of_one_cube():
    unit = ((0, 0, 0), (1, 1, 1))
    cube = box(*unit)
    whole = "volume 1 0.002; components 1; euler 2"
    lines = ["# Every triangle brings its own three vertices"]
    for triangle in cube:
        lines += [f"v {line_of(p)}" for p in triangle] + ["f -3 -2 -1"]
    case("redundant_vertices", "A cube whose every corner is listed four to five times.",
         whole, "\n".join(lines) + "\n")
    case("isolated_vertices", "A cube and four vertices of no face, one of them far away.", whole,
         obj(cube, "Isolated vertices",
             before="v 1000 1000 1000\nv 2 2 2\nv -5 0 0\nv 0.5 0.5 0.5"))
    again = quad((1, 0, 1), (1, 1, 1), (0, 1, 1), (0, 0, 1))
    case("overlapping_triangles", "A cube whose top lies there twice, cut along both diagonals.",
         whole, obj(cube + again, "Coplanar overlap"))
    inside = [((0.2, 0.2, 1), (0.8, 0.3, 1), (0.4, 0.9, 1))]
    case("overlapping_triangle_inside", "A cube with one more triangle within its top.",
         whole, obj(cube + inside, "Coplanar overlap"))
    fin = [((1, 0.25, 1), (1, 0.75, 1), (1.5, 0.5, 1.4))]
    case("hanging_triangle", "A cube with a fin: one triangle that hangs in the air.",
         "volume 1 0.02", obj(cube + fin, "A fin"))
    split = [t for t in cube if not all(p[2] == 1 for p in t)]
    split += panel(2, 1, (0, 0.37, 1), (0, 1))
    case("t_junction", "A cube whose top is cut in two and whose sides are not.",
         whole, obj(split, "Two T-junctions"))
    nothing = [((0, 0, 0), (0, 0, 0), (1, 1, 1)), ((0, 0, 1), (0.5, 0, 1), (1, 0, 1)),
               ((0.5, 0.5, 0.5),) * 3]
    case("degenerate_triangle", "A cube and three triangles without area.",
         whole + "; degenerate 3", obj(cube + nothing, "Degenerate triangles"))
    mixed = [t if i % 3 else (t[0], t[2], t[1]) for i, t in enumerate(cube)]
    case("reversed_normals", "A cube, every third triangle turned inside out.",
         whole, obj(mixed, "Mixed orientation"))
    case("inside_out", "A cube turned inside out altogether.",
         whole, obj(flipped(cube), "Inward orientation"))
    third = (0, 0.3, 0.7, 1)
    holed = grid_box(third, third, third)
    in_hole = lambda t: all(p[2] == 1 and 0.3 <= p[0] <= 0.7 and 0.3 <= p[1] <= 0.7 for p in t)
    case("hole", "A cube with a square hole in its top.",
         whole, obj([t for t in holed if not in_hole(t)], "A hole"))
    case("doubled_faces", "A cube with every face twice, in the same orientation.",
         whole + "; duplicates 12; interfaces 0", obj(cube + cube, "Doubled faces"))
    case("doubled_faces_opposite", "A cube with every face twice, in opposite orientation.",
         whole + "; duplicates 12; interfaces 0",
         obj(cube + flipped(cube), "Doubled faces, both ways"))
    open_box = box(*unit, without=[(2, 1)])
    case("doubled_open_box", "A box without lid, every face twice: one copy of each must count.",
         "volume 1 0.01; components 1; euler 2; duplicates 10; interfaces 0",
         obj(open_box + flipped(open_box), "A doubled open box"))
    free = panel(1, 0.5, (0.2, 0.8), (1.4, 2))
    case("doubled_free_panel", "A cube, and apart from it a free panel that lies there twice.",
         "volume 1 0.03; components 2; euler 4; duplicates 2; interfaces 0",
         obj(cube + free + flipped(free), "A doubled free panel"))
    text = obj(holed, "A corner that is no number")
    case("nan_vertex", "A cube with a vertex that is no number: the faces around it are dropped.",
         whole + "; nonfinite 6", text.replace("\nv 0.3 0.3 1\n", "\nv nan 0.3 1\n"))
    case("wild_index", "A cube and a face whose index leads nowhere.",
         whole + "; wild 1", obj(cube, "A wild index", after="f 1 2 99"))
    inner = flipped(box((0.3, 0.3, 0.3), (0.7, 0.7, 0.7)))
    case("cavity", "A cube with a cubic cavity: filled by the default rule, kept by parity.",
         whole + "\nevenodd volume 0.936 0.002; components 2; euler 4",
         obj(cube + inner, "A cavity"))


def turn(point):
    """The unit cube turned about its centre so that a diagonal stands upright."""
    x, y, z = [c - 0.5 for c in point]
    a, b = math.pi / 4, math.atan(math.sqrt(2))
    x, y = x * math.cos(a) - y * math.sin(a), x * math.sin(a) + y * math.cos(a)
    y, z = y * math.cos(b) - z * math.sin(b), y * math.sin(b) + z * math.cos(b)
    return (x, y, z)


def defects_of_two_bodies():
    up = [(0, 0, 0), (1, 1, 0), (1, 0, 1), (0, 1, 1)]
    down = [(1, 1, 1), (0, 0, 1), (0, 1, 0), (1, 0, 0)]
    solid = lambda p: [(p[0], p[1], p[2]), (p[0], p[3], p[1]), (p[0], p[2], p[3]),
                       (p[1], p[3], p[2])]
    # Stood on a tip and turned a little: sharp edges along the diagonals of the grid fray.
    turned = [[turn(p) for p in points] for points in (up, down)]
    case("intersecting_triangles", "Two tetrahedra through each other.",
         "volume 0.5 0.005; components 1; euler 2",
         obj(solid(turned[0]) + solid(turned[1]), "Two tetrahedra"))
    case("intersecting_triangles_diagonal",
         "The same, every edge along a diagonal of the grid: tips below a cell may come off.",
         "volume 0.5 0.005", obj(solid(up) + solid(down), "Two tetrahedra, diagonal"))
    two = "volume 2 0.004; components 1; euler 2"
    left, right = box((0, 0, 0), (1, 1, 1)), box((1, 0, 0), (2, 1, 1))
    case("abutting_boxes", "Two boxes that share a whole face, triangle for triangle.",
         two + "; duplicates 2; interfaces 2", obj(left + right, "Abutting boxes"))
    half = grid_box((0, 1), (0, 0.5, 1), (0, 1)) + grid_box((1, 2), (0.5, 1, 1.5), (0, 1))
    case("abutting_boxes_partly", "Two boxes that share half a face, triangle for triangle.",
         two + "; duplicates 2; interfaces 2", obj(half, "Abutting boxes, half"))
    unlike = left + box((1, 0.25, 0.25), (2, 1.25, 1.25))
    case("abutting_boxes_unlike", "Two boxes that touch in a part of a face, cut differently.",
         two + "; duplicates 0", obj(unlike, "Abutting boxes, no common vertex"))
    over = "volume 1.5 0.004; components 1; euler 2"
    other = box((0.5, 0, 0), (1.5, 1, 1))
    case("overlapping_boxes", "Two boxes that overlap by half, with four flush faces.",
         over, obj(left + other, "Overlap with flush faces"))
    lidless = box((0, 0, 0), (1, 1, 1), without=[(2, 1)])
    case("overlapping_boxes_one_lid", "Two boxes that overlap by half; one lacks its lid.",
         "volume 1.5 0.015; components 1; euler 2",
         obj(lidless + other, "Overlap, one lid missing"))
    case("thin_plate", "A plate far thinner than a cell: no result, and a reason.",
         "empty", obj(box((0, 0, 0), (1, 1, 0.004)), "A thin plate"))
    case("free_panel", "A free panel alone encloses nothing: it becomes a plate of about a cell.",
         "volume 0.015 0.015; components 1; euler 2",
         obj(panel(2, 0, (0, 1), (0, 1)), "A free panel"))


if __name__ == "__main__":
    models()
    defects_of_one_cube()
    defects_of_two_bodies()
