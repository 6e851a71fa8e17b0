#!/usr/bin/env python3
"""Writes the meshes of the project's own scenes: python3 scenes/make.py

Everything here is made from formulas and from the published measurements of the Cornell box
(www.graphics.cornell.edu/online/box/data.html); running it again gives the same bytes. The materials (.mtl)
and scene files (.toml) beside the meshes are written by hand.
"""

import math
from pathlib import Path

HERE = Path(__file__).parent


class Mesh:
    """Faces by material, over vertices that are written once each."""

    def __init__(self):
        self.positions, self.normals, self.faces = {}, {}, []

    def face(self, material, corners, normals=None):
        index = lambda table, vector: table.setdefault(tuple(round(x, 5) + 0.0 for x in vector), len(table) + 1)
        vertices = [index(self.positions, corner) for corner in corners]
        normals = [index(self.normals, normal) for normal in normals] if normals else [None] * len(corners)
        self.faces.append((material, list(zip(vertices, normals))))

    def box(self, material, low, high, turn=0.0):
        """A box with its faces outwards, turned by `turn` degrees around the vertical through `low`."""
        sine, cosine = math.sin(math.radians(turn)), math.cos(math.radians(turn))

        def corner(x, y, z):
            x, z = x - low[0], z - low[2]
            return (low[0] + cosine * x + sine * z, y, low[2] - sine * x + cosine * z)

        x, y, z = zip(low, high)
        for face in (
            [(0, 0, 0), (0, 1, 0), (1, 1, 0), (1, 0, 0)], [(0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)],
            [(0, 0, 0), (0, 0, 1), (0, 1, 1), (0, 1, 0)], [(1, 0, 0), (1, 1, 0), (1, 1, 1), (1, 0, 1)],
            [(0, 0, 0), (1, 0, 0), (1, 0, 1), (0, 0, 1)], [(0, 1, 0), (0, 1, 1), (1, 1, 1), (1, 1, 0)],
        ):
            self.face(material, [corner(x[i], y[j], z[k]) for i, j, k in face])

    def room(self, materials, low, high):
        """The inside of a box; `materials` of its faces -z, +z, -x, +x, floor, ceiling."""
        inside = Mesh()
        inside.box(None, low, high)
        positions = list(inside.positions)
        for material, (_, corners) in zip(materials, inside.faces):
            if material:
                self.face(material, [positions[vertex - 1] for vertex, _ in reversed(corners)])

    def write(self, path, library, comment):
        number = lambda x: f"{x:.5f}".rstrip("0").rstrip(".")
        lines = [f"# {comment} Written by scenes/make.py."] + ([f"mtllib {library}"] if library else [])
        lines += ["v " + " ".join(map(number, position)) for position in self.positions]
        lines += ["vn " + " ".join(map(number, normal)) for normal in self.normals]
        current = None
        for material, corners in self.faces:
            if material != current:
                lines.append(f"usemtl {material}")
                current = material
            lines.append("f " + " ".join(f"{v}" if n is None else f"{v}//{n}" for v, n in corners))
        path.parent.mkdir(exist_ok=True)
        path.write_text("\n".join(lines) + "\n")


def cornell(name="cornell", back="white", floor="white", tall_block="white"):
    """The measured box; x to the left of the picture, z into it. The lamp hangs half a unit below the ceiling,
    which would hide it otherwise. `back` is the material of the wall at the back."""
    mesh = Mesh()
    for material, corners in [
        (floor, "552.8 0 0  0 0 0  0 0 559.2  549.6 0 559.2"),
        ("white", "556 548.8 0  556 548.8 559.2  0 548.8 559.2  0 548.8 0"),
        (back, "549.6 0 559.2  0 0 559.2  0 548.8 559.2  556 548.8 559.2"),
        ("green", "0 0 559.2  0 0 0  0 548.8 0  0 548.8 559.2"),
        ("red", "552.8 0 0  549.6 0 559.2  556 548.8 559.2  556 548.8 0"),
        ("lamp", "343 548.3 227  343 548.3 332  213 548.3 332  213 548.3 227"),
    ]:
        values = list(map(float, corners.split()))
        mesh.face(material, [values[i : i + 3] for i in range(0, 12, 3)])
    short = [(130, 65), (82, 225), (240, 272), (290, 114)]
    tall = [(423, 247), (265, 296), (314, 456), (472, 406)]
    for height, base, material in (165, short, "white"), (330, tall, tall_block):
        mesh.face(material, [(x, height, z) for x, z in base])
        for (x0, z0), (x1, z1) in zip(base, base[1:] + base[:1]):
            mesh.face(material, [(x0, 0, z0), (x1, 0, z1), (x1, height, z1), (x0, height, z0)])
    as_what = "as measured" if back == "white" else f"with a {back} back wall"
    if floor != "white":
        as_what = f"with a floor of {floor} and a block of {tall_block}"
    mesh.write(HERE / f"cornell/{name}.obj", f"{name}.mtl", f"The Cornell box {as_what}.")


def sphere(subdivisions=3):
    """The unit sphere: an icosahedron, every triangle cut in four, the vertices pushed out."""
    golden = (1 + math.sqrt(5)) / 2
    unit = lambda p: tuple(x / math.sqrt(sum(x * x for x in p)) for x in p)
    middle = lambda p, q: unit(tuple(a + b for a, b in zip(p, q)))
    corners = [unit(p) for s in (-1, 1) for t in (-golden, golden) for p in ((0, s, t), (s, t, 0), (t, 0, s))]
    edge = min(math.dist(corners[0], corner) for corner in corners[1:]) * 1.01
    near = lambda *ps: all(math.dist(p, q) < edge for p in ps for q in ps)
    triangles = []
    for i, p in enumerate(corners):
        for j, q in enumerate(corners[:i]):
            for r in corners[:j]:
                if near(p, q, r):
                    normal = [
                        (q[a] - p[a]) * (r[b] - p[b]) - (q[b] - p[b]) * (r[a] - p[a]) for a, b in ((1, 2), (2, 0), (0, 1))
                    ]
                    outwards = sum(x * y for x, y in zip(normal, p)) > 0
                    triangles.append((p, q, r) if outwards else (p, r, q))
    for _ in range(subdivisions):
        finer = []
        for p, q, r in triangles:
            pq, qr, rp = middle(p, q), middle(q, r), middle(r, p)
            finer += [(p, pq, rp), (pq, q, qr), (rp, qr, r), (pq, qr, rp)]
        triangles = finer
    mesh = Mesh()
    for triangle in triangles:
        mesh.face("sphere", triangle, triangle)
    mesh.write(HERE / "shapes/sphere.obj", None, "The unit sphere with its normals.")


def caustic():
    """A dark room with a small bright lamp, and a glass prism on its floor; the scene file adds a glass ball."""
    mesh = Mesh()
    mesh.room(["wall", None, "wall", "wall", "floor", "wall"], (-2, 0, -2), (2, 3, 2))
    mesh.face("lamp", [(x, 2.9, z) for x, z in ((-1.1, -0.1), (-0.9, -0.1), (-0.9, 0.1), (-1.1, 0.1))])
    front, back = ([(0.5, 0.05, z), (1.3, 0.05, z), (0.9, 0.7, z)] for z in (0.9, -0.6))
    mesh.face("glass", front)
    mesh.face("glass", back[::-1])
    for i in range(3):
        j = (i + 1) % 3
        mesh.face("glass", [front[i], back[i], back[j], front[j]])
    mesh.write(HERE / "caustic/caustic.obj", "caustic.mtl", "A room with a lamp and a prism.")


def glossy():
    """A floor, a wall behind it, a wide lamp and a small one; the scene file adds the balls."""
    mesh = Mesh()
    mesh.face("floor", [(-9, 0, 6), (9, 0, 6), (9, 0, -4), (-9, 0, -4)])
    mesh.face("wall", [(-9, 0, -4), (9, 0, -4), (9, 7, -4), (-9, 7, -4)])
    mesh.face("wide lamp", [(x, 6, z) for x, z in ((-3, -1), (3, -1), (3, 2), (-3, 2))])
    mesh.face("small lamp", [(x, 4, z) for x, z in ((5, 3), (5.3, 3), (5.3, 3.3), (5, 3.3))])
    mesh.write(HERE / "glossy/glossy.obj", "glossy.mtl", "A stage with two lamps.")


def two_rooms():
    """Two rooms of 4 m with a wall between them and a door ajar in it. The lamp is in the far room."""
    mesh = Mesh()
    mesh.room(["red", "white", "white", "white", "floor", "white"], (0, 0, 0), (4, 2.5, 4))
    mesh.room(["white", "white", "white", "white", "floor", "white"], (4, 0, 0), (8, 2.5, 4))
    # Their common faces would close the doorway.
    mesh.faces = [face for face in mesh.faces if not mesh_is_at(mesh, face, 4)]
    for low, high in (
        ((3.95, -0.1, -0.1), (4.05, 2.6, 1.5)),
        ((3.95, -0.1, 2.4), (4.05, 2.6, 4.1)),
        ((3.95, 2.0, 1.5), (4.05, 2.6, 2.4)),
    ):
        mesh.box("white", low, high)
    mesh.box("door", (3.96, 0.01, 1.51), (4.0, 1.99, 2.39), turn=-20)
    mesh.box("table", (1.2, -0.05, 0.5), (2.2, 0.7, 1.3))
    mesh.face("lamp", [(x, 2.4, z) for x, z in ((5.5, 1.5), (6.5, 1.5), (6.5, 2.5), (5.5, 2.5))])
    mesh.write(HERE / "two-rooms/two-rooms.obj", "two-rooms.mtl", "Two rooms and a door ajar.")


def lightmap():
    """A room without front, with a block and a lamp, each quadrilateral with a chart of its own in a grid of
    four columns and three rows."""
    room = Mesh()
    room.room(["white", None, "red", "green", "white", "white"], (-1, 0, -1), (1, 2, 1))
    room.box("white", (-0.65, 0, -0.55), (-0.05, 0.9, 0.05), turn=20)
    room.faces = [face for face in room.faces if not rests(room, face)]
    room.face("lamp", [(-0.35, 1.98, -0.35), (0.35, 1.98, -0.35), (0.35, 1.98, 0.35), (-0.35, 1.98, 0.35)])
    number = lambda x: f"{x:.5f}".rstrip("0").rstrip(".")
    lines = ["# A room whose faces are charts of a lightmap. Written by scenes/make.py.", "mtllib room.mtl"]
    lines += ["v " + " ".join(map(number, position)) for position in room.positions]
    for chart, (material, corners) in enumerate(room.faces):
        column, row = chart % 4, chart // 4
        for u, v in (0.08, 0.08), (0.92, 0.08), (0.92, 0.92), (0.08, 0.92):
            lines.append(f"vt {number((column + u) / 4)} {number((row + v) / 3)}")
        lines.append(f"usemtl {material}")
        lines.append("f " + " ".join(f"{v}/{4 * chart + i + 1}" for i, (v, _) in enumerate(corners)))
    (HERE / "lightmap").mkdir(exist_ok=True)
    (HERE / "lightmap/room.obj").write_text("\n".join(lines) + "\n")


def rests(mesh, face):
    """True for the bottom of the block, which has no light: it is as large as the block."""
    positions = list(mesh.positions)
    corners = [positions[vertex - 1] for vertex, _ in face[1]]
    return all(y == 0 for _, y, _ in corners) and max(x for x, _, _ in corners) < 0.9


def mesh_is_at(mesh, face, x):
    positions = list(mesh.positions)
    return all(positions[vertex - 1][0] == x for vertex, _ in face[1])


if __name__ == "__main__":
    cornell()
    cornell("dark-wall", back="black")
    cornell("rough", floor="metal", tall_block="plastic")
    sphere()
    caustic()
    glossy()
    two_rooms()
    lightmap()
