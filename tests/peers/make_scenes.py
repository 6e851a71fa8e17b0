"""Makes the small scenes of `agreement.py` in `tests/peers/scenes`: what both renderers can say exactly.

    python3 tests/peers/make_scenes.py

Each is a `.toml` with its `.obj` and `.mtl`; the pictures that they need are computed as well.
"""

import workbench
from scene_file import write_scene
from workbench import np, write_picture

FOLDER = workbench.HERE / "scenes"
HARD = FOLDER / "hard"
SIZE = [96, 96]
CAMERA = {"eye": [0.0, 0.2, 4.2], "look_at": [0.0, -0.1, 0.0], "up": [0.0, 1.0, 0.0], "fov": 34.0}

WHITE = "Kd 0.73 0.72 0.7"
RED = "Kd 0.6 0.07 0.05"
GREEN = "Kd 0.12 0.45 0.15"
LAMP = "Kd 0 0 0\nKe 12 10 8"


class Model:
    """Grows an OBJ file and its materials."""

    def __init__(self):
        self.lines, self.materials = [], {}
        self.positions = self.texcoords = self.normals = 0

    def use(self, name, material):
        self.materials[name] = material
        self.lines.append(f"usemtl {name}")

    def triangles(self, positions, faces, texcoords=None, normals=None):
        """Adds triangles; texture coordinates and normals belong to the positions one by one."""
        numbers = lambda key, rows: [f"{key} " + " ".join(f"{x + 0.0:.7g}" for x in row) for row in rows]
        self.lines += numbers("v", positions)
        self.lines += numbers("vt", texcoords) if texcoords is not None else []
        self.lines += numbers("vn", normals) if normals is not None else []
        for face in faces:
            corners = []
            for i in face:
                vt = str(self.texcoords + i + 1) if texcoords is not None else ""
                vn = str(self.normals + i + 1) if normals is not None else ""
                corners.append(f"{self.positions + i + 1}/{vt}/{vn}".rstrip("/"))
            self.lines.append("f " + " ".join(corners))
        self.positions += len(positions)
        self.texcoords += len(texcoords) if texcoords is not None else 0
        self.normals += len(normals) if normals is not None else 0

    def quad(self, corner, u, v, repeat=None):
        """A parallelogram that faces along u x v; `repeat` times the texture along its edges."""
        corner, u, v = (np.array(x, float) for x in (corner, u, v))
        texcoords = np.array([[0, 0], [1, 0], [1, 1], [0, 1]]) * repeat if repeat else None
        self.triangles([corner, corner + u, corner + u + v, corner + v], [[0, 1, 2], [0, 2, 3]], texcoords)

    def box(self, centre, half, turn=0.0):
        """A box that faces outwards, turned about the vertical."""
        c, s = np.cos(np.radians(turn)), np.sin(np.radians(turn))
        axes = np.array([[c, 0, -s], [0, 1, 0], [s, 0, c]]) * np.array(half)[:, None]
        for i in range(3):
            u, v, w = axes[i], axes[(i + 1) % 3], axes[(i + 2) % 3]
            self.quad(centre + w - u - v, 2 * u, 2 * v)
            self.quad(centre - w - u - v, 2 * v, 2 * u)

    def sphere(self, centre, radius, divisions, smooth=False):
        """A subdivided icosahedron that faces outwards; `smooth` gives it the normals of the sphere."""
        g = (1 + 5**0.5) / 2
        points = [[-1, g, 0], [1, g, 0], [-1, -g, 0], [1, -g, 0], [0, -1, g], [0, 1, g]]
        points += [[0, -1, -g], [0, 1, -g], [g, 0, -1], [g, 0, 1], [-g, 0, -1], [-g, 0, 1]]
        faces = "0 11 5 0 5 1 0 1 7 0 7 10 0 10 11 1 5 9 5 11 4 11 10 2 10 7 6 7 1 8"
        faces += " 3 9 4 3 4 2 3 2 6 3 6 8 3 8 9 4 9 5 2 4 11 6 2 10 8 6 7 9 8 1"
        points, faces = [np.array(p, float) for p in points], np.array(faces.split(), int).reshape(-1, 3)
        for _ in range(divisions):
            middles, finer = {}, []
            for a, b, c in faces:
                ab, bc, ca = (self._middle(points, middles, *edge) for edge in ((a, b), (b, c), (c, a)))
                finer += [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
            faces = finer
        units = np.array([p / np.linalg.norm(p) for p in points])
        self.triangles(np.array(centre) + radius * units, faces, normals=units if smooth else None)

    @staticmethod
    def _middle(points, middles, a, b):
        key = (min(a, b), max(a, b))
        if key not in middles:
            middles[key] = len(points)
            points.append((points[a] / np.linalg.norm(points[a]) + points[b] / np.linalg.norm(points[b])) / 2)
        return middles[key]

    def room(self, lamp=0.5):
        """Floor, ceiling and three walls of the cube -1 ... 1, open to the front, with a square lamp."""
        self.use("white", WHITE)
        self.quad([-1, -1, 1], [2, 0, 0], [0, 0, -2])
        self.quad([-1, 1, -1], [2, 0, 0], [0, 0, 2])
        self.quad([-1, -1, -1], [2, 0, 0], [0, 2, 0])
        self.use("red", RED)
        self.quad([-1, -1, 1], [0, 0, -2], [0, 2, 0])
        self.use("green", GREEN)
        self.quad([1, -1, -1], [0, 0, 2], [0, 2, 0])
        if lamp:
            self.use("lamp", LAMP)
            self.quad([-lamp, 0.99, -lamp], [2 * lamp, 0, 0], [0, 0, 2 * lamp])

    def floor(self, material=WHITE, repeat=None):
        self.use("floor", material)
        self.quad([-3, -1, 3], [6, 0, 0], [0, 0, -6], repeat)

    def write(self, name, folder=FOLDER, **more):
        (folder / f"{name}.obj").write_text("\n".join([f"mtllib {name}.mtl", *self.lines, ""]))
        text = "\n".join(f"newmtl {key}\n{value}\n" for key, value in self.materials.items())
        (folder / f"{name}.mtl").write_text(text)
        description = {"render": {"size": SIZE}, "camera": CAMERA, "mesh": [{"file": f"{name}.obj"}]}
        write_scene(folder / f"{name}.toml", description | more)


def boxes(model, tall=WHITE, low=WHITE):
    model.use("tall", tall)
    model.box(np.array([-0.35, -0.4, -0.3]), [0.28, 0.6, 0.28], 18)
    model.use("low", low)
    model.box(np.array([0.35, -0.7, 0.3]), [0.28, 0.3, 0.28], -17)


def spheres(model, left, right):
    model.use("left", left)
    model.sphere([-0.55, -0.5, 0.0], 0.5, 2)
    model.use("right", right)
    model.sphere([0.55, -0.5, 0.2], 0.5, 2)


def diffuse():
    model = Model()
    model.room()
    boxes(model)
    model.write("diffuse")


def mirror():
    model = Model()
    model.room()
    boxes(model, tall="Kd 0 0 0\nKs 0.9 0.8 0.6\nillum 3", low="Kd 0.5 0.7 0.9\nPm 1\nPr 0")
    model.write("mirror")


def glass():
    model = Model()
    model.room(lamp=0.9)
    spheres(model, "Kd 0 0 0\nNi 1.5\nTf 1 1 1\nillum 7", "Kd 0 0 0\nNi 1.33\nTf 0.9 0.7 0.5\nillum 7")
    model.write("glass")


def rough_glass():
    model = Model()
    model.room(lamp=0.9)
    glass = "Kd 0 0 0\nNi 1.5\nTf 1 1 1\nillum 7\nPr "
    spheres(model, glass + "0.55", glass + "0.8")
    model.write("rough-glass")


def pane():
    """Thin panes across the room and beside each other, in front of boxes and below the lamp."""
    model = Model()
    model.room(lamp=0.9)
    boxes(model)
    model.use("pane", "Kd 0 0 0\nNi 1.5\nillum 7")
    model.quad([-1, 0.4, 0.9], [1.2, 0, 0], [0, 0.1, -1.8])
    model.quad([-0.1, -0.9, 0.9], [0.9, 0, -0.3], [0, 1.1, 0])
    model.quad([-0.1, -0.7, 0.7], [0.9, 0, -0.3], [0, 1.1, 0])
    model.write("pane", material={"pane": {"kind": "pane"}})


def metal():
    model = Model()
    model.room()
    spheres(model, "Kd 0.9 0.6 0.3\nPm 1\nPr 0.4", "Kd 0 0 0\nKs 0.4 0.5 0.6\nPm 1\nPr 0.8")
    model.use("plate", "Kd 1 1 1\nPm 1\nPr 0.55")
    model.quad([-0.9, -0.999, 0.9], [1.8, 0, 0], [0, 0, -1.8])
    model.write("metal")


def plastic():
    model = Model()
    model.room()
    rough = "Kd 0.2 0.4 0.8\nKs 0.04 0.04 0.04\nNi 1.5\nillum 2\nPm 0\nPr "
    spheres(model, rough + "0.4", rough + "0.7")
    model.write("plastic")


def varnish():
    model = Model()
    model.room()
    smooth = "Ks 0.04 0.04 0.04\nNi 1.5\nillum 2\nPm 0\nPr 0\nKd "
    boxes(model, tall=smooth + "0.8 0.5 0.2", low=smooth + "0.9 0.9 0.9")
    model.write("varnish")


def textured():
    model = Model()
    model.floor("Kd 1 1 1\nmap_Kd tiles.png", repeat=3)
    model.use("fence", "Kd 0.8 0.7 0.2\nmap_d holes.png")
    model.quad([-0.9, -1, 0.2], [1.8, 0, 0], [0, 1.5, 0], repeat=2)
    model.use("back", "Kd 0.9 0.9 0.9\nmap_Kd tiles.png")
    model.quad([-1.2, -1, -0.8], [2.4, 0, 0], [0, 2, 0], repeat=1)
    model.write("textured", environment={"map": "sky.exr", "rotate": {"axis": [0.0, 1.0, 0.0], "degrees": 35.0}})
    write_picture(FOLDER / "sky.exr", sky(32, 16))
    write_picture(FOLDER / "tiles.png", tiles(16))
    write_picture(FOLDER / "holes.png", holes(16))


def sky(width, height):
    """A sun of a few texels over a gradient: a picture with a direction."""
    y, x = np.mgrid[0:height, 0:width]
    up = 1 - (y + 0.5) / height
    picture = np.stack([0.2 + 0.3 * up, 0.25 + 0.5 * up, 0.3 + 0.9 * up], axis=-1)
    picture *= (1 + 0.5 * np.sin(2 * np.pi * x / width))[:, :, None]
    picture[3:5, 20:23] = [30, 26, 20]
    return picture


def tiles(size):
    y, x = np.mgrid[0:size, 0:size]
    odd = ((x // 4 + y // 4) % 2)[:, :, None]
    return np.where(odd, [0.8, 0.75, 0.6], [0.1, 0.2, 0.35]) * (0.4 + 0.6 * x / size)[:, :, None]


def holes(size):
    """White with grey and black dots: a cut-out that is also half transparent somewhere."""
    y, x = np.mgrid[0:size, 0:size]
    ring = np.hypot(x - size / 2 + 0.5, y - size / 2 + 0.5)
    return np.repeat(np.where(ring < 3.5, 0.0, np.where(ring < 5.5, 0.5, 1.0))[:, :, None], 3, axis=2)


def lamps(name, light, lens=None):
    """The open room with boxes, in the light of one light without surface."""
    model = Model()
    model.room(lamp=None)
    boxes(model)
    more = {"camera": CAMERA | lens} if lens else {}
    model.write(name, **light, **more)


def point():
    lamps("point", {"light": [{"kind": "point", "position": [0.3, 0.6, 0.4], "intensity": [3.0, 2.5, 2.0]}]})


def spot():
    spot = {"kind": "spot", "position": [0.4, 0.9, 0.9], "direction": [-0.5, -1.0, -0.8]}
    lamps("spot", {"light": [spot | {"intensity": [8.0, 7.0, 6.0], "inner_degrees": 20.0, "outer_degrees": 35.0}]})


def directional():
    sun = {"kind": "directional", "direction": [-0.4, -0.5, -1.0], "irradiance": [3.0, 2.8, 2.5]}
    lamps("directional", {"light": [sun]})


def constant():
    lamps("constant", {"environment": {"radiance": [0.8, 1.0, 1.2]}})


def lens():
    lamps("lens", {"environment": {"radiance": [1.0, 1.0, 1.0]}}, {"lens_radius": 0.15, "focus_distance": 4.2})


def many_lights():
    model = Model()
    model.room(lamp=None)
    boxes(model)
    for i in range(24):
        angle = 2 * np.pi * i / 24
        colour = 3 + 2 * np.cos(angle + np.array([0, 2, 4]))
        model.use(f"bulb{i % 6}", "Kd 0 0 0\nKe " + " ".join(f"{c:.3f}" for c in 2 + i % 6 * colour))
        model.sphere([0.7 * np.cos(angle), 0.7 + 0.15 * np.sin(3 * angle), 0.7 * np.sin(angle)], 0.04, 1)
    model.write("many-lights")


def bent_normals():
    model = Model()
    model.room(lamp=None)
    model.use("relief", "Kd 0.7 0.7 0.7\nnorm waves.png")
    model.quad([-0.9, -0.9, -0.9], [1.8, 0, 0], [0, 1.8, 0], repeat=1)
    model.quad([-0.9, -0.99, 0.6], [1.8, 0, 0], [0, 0.9, -0.9], repeat=2)
    model.write("bent-normals", environment={"radiance": [1.0, 1.0, 1.0]})
    y, x = np.mgrid[0:32, 0:32]
    # Shallow: where a bent normal looks away from the viewer, Mitsuba flips it and we turn it back.
    slope = 0.15 * np.stack([np.sin(2 * np.pi * x / 16), np.cos(2 * np.pi * y / 16)], axis=-1)
    normal = np.concatenate([slope, np.ones((32, 32, 1))], axis=2)
    normal = 0.5 + 0.5 * normal / np.linalg.norm(normal, axis=2, keepdims=True)
    # Stored as they are: undo the sRGB curve that the PNG writer applies.
    write_picture(FOLDER / "waves.png", np.where(normal <= 0.04045, normal / 12.92, ((normal + 0.055) / 1.055) ** 2.4))


def smooth_normals():
    model = Model()
    model.room()
    model.use("ball", "Kd 0.6 0.5 0.4")
    model.sphere([0.0, -0.4, 0.0], 0.6, 3, smooth=True)
    model.write("smooth-normals")


def closed_room(model):
    """The room with the wall behind the camera, which stands inside."""
    model.room(lamp=None)
    model.use("white", WHITE)
    model.quad([1, -1, 1], [-2, 0, 0], [0, 2, 0])


INSIDE = {"camera": CAMERA | {"eye": [0.0, 0.1, 0.95], "look_at": [0.0, -0.2, 0.0], "fov": 80.0}}
PANE = "Kd 0 0 0\nNi 1.5\nTf 1 1 1\nillum 7"


def up_light():
    """All light comes by way of the ceiling."""
    model = Model()
    closed_room(model)
    boxes(model)
    model.use("shade", "Kd 0.3 0.3 0.3")
    model.quad([-0.15, 0.2, -0.15], [0.3, 0, 0], [0, 0, 0.3])
    for corner, edge in (([-0.15, 0.2, -0.15], [0.3, 0, 0]), ([0.15, 0.2, -0.15], [0, 0, 0.3]),
                         ([0.15, 0.2, 0.15], [-0.3, 0, 0]), ([-0.15, 0.2, 0.15], [0, 0, -0.3])):
        model.quad(corner, edge, [0, 0.15, 0])
        model.quad(corner, [0, 0.15, 0], edge)
    model.use("lamp", "Kd 0 0 0\nKe 160 140 120")
    model.quad([-0.1, 0.21, 0.1], [0.2, 0, 0], [0, 0, -0.2])
    model.write("up-light", HARD, **INSIDE)


def glass_lamp():
    """All light comes through a glass ball around the lamp."""
    model = Model()
    closed_room(model)
    boxes(model)
    model.use("ball", PANE)
    model.sphere([0.0, 0.6, 0.0], 0.2, 3, smooth=True)
    model.use("lamp", "Kd 0 0 0\nKe 700 600 500")
    model.sphere([0.0, 0.6, 0.0], 0.03, 1)
    model.write("glass-lamp", HARD, **INSIDE)


def keyhole():
    """All light comes through a slot from the room behind the wall."""
    model = Model()
    closed_room(model)
    boxes(model)
    model.use("wall", WHITE)
    low, high, left, right = -0.1, 0.3, -0.1, 0.1
    for corner, u, v in (([-1, -1, -0.6], [2, 0, 0], [0, 1 + low, 0]), ([-1, high, -0.6], [2, 0, 0], [0, 1 - high, 0]),
                         ([-1, low, -0.6], [1 + left, 0, 0], [0, high - low, 0]),
                         ([right, low, -0.6], [1 - right, 0, 0], [0, high - low, 0])):
        model.quad(corner, u, v)
        model.quad(corner, v, u)
    model.use("lamp", "Kd 0 0 0\nKe 240 210 180")
    model.quad([-0.9, 0.99, -0.95], [0.3, 0, 0], [0, 0, 0.3])
    model.write("keyhole", HARD, **INSIDE)


def mirror_ball():
    """The caustic of a small lamp by a small mirror ball."""
    model = Model()
    closed_room(model)
    model.use("ball", "Kd 0.9 0.9 0.9\nPm 1\nPr 0")
    model.sphere([0.3, -0.8, 0.2], 0.2, 3, smooth=True)
    model.use("lamp", "Kd 0 0 0\nKe 5333 4800 4267")
    model.quad([-0.015, 0.99, -0.015], [0.03, 0, 0], [0, 0, 0.03])
    model.write("mirror-ball", HARD, **INSIDE)


def glass_ball():
    """A ball of glass under a wide lamp."""
    model = Model()
    closed_room(model)
    model.use("ball", PANE)
    model.sphere([0.0, -0.5, 0.0], 0.5, 3, smooth=True)
    model.use("lamp", "Kd 0 0 0\nKe 4.8 4.32 3.84")
    model.quad([-0.5, 0.99, -0.5], [1, 0, 0], [0, 0, 1])
    model.write("glass-ball", HARD, **INSIDE)


def rings():
    """Caustics of metal rings on a table."""
    model = Model()
    model.room(lamp=0.1)
    model.use("ring", "Kd 0.9 0.7 0.4\nPm 1\nPr 0.1")
    turns = 2 * np.pi * np.arange(65) / 64
    for x, z, radius in ((-0.4, 0.2, 0.35), (0.4, 0.0, 0.4)):
        circle = np.stack([x + radius * np.cos(turns), 0 * turns, z + radius * np.sin(turns)], axis=1)
        points = np.concatenate([circle - [0, 1, 0], circle - [0, 0.75, 0]])
        inwards = np.stack([-np.cos(turns), 0 * turns, -np.sin(turns)], axis=1)
        faces = [[i, i + 65, i + 1] for i in range(64)] + [[i + 1, i + 65, i + 66] for i in range(64)]
        model.triangles(points, faces, normals=np.concatenate([inwards, inwards]))
        faces = [face[::-1] for face in faces]
        model.triangles(points, faces, normals=-np.concatenate([inwards, inwards]))
    model.write("rings", HARD)


SCENES = [diffuse, mirror, glass, rough_glass, pane, metal, plastic, varnish, textured, point, spot, directional]
SCENES += [constant, lens, many_lights, bent_normals, smooth_normals]
SCENES += [up_light, glass_lamp, keyhole, mirror_ball, glass_ball, rings]

if __name__ == "__main__":
    HARD.mkdir(parents=True, exist_ok=True)
    for make in SCENES:
        make()
