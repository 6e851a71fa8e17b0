"""Rooms by random numbers: furniture, materials and lamps that no constant of the project was chosen on.

    python3 tests/peers/random_rooms.py FOLDER SEED...

Writes `room-SEED.toml` and its mesh for each seed. The kind of light follows from the seed modulo eight: a
ceiling lamp, a lamp that shines up, sky in a window, a lamp behind a door ajar, a lamp in a glass ball, a spot,
a dozen small lamps, and the sun through a window. `methods.py --rooms SEED...` measures methods on them.
"""

import random
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "scenes"))
from make import HERE as SCENES, Mesh  # noqa: E402

LIGHTS = ("ceiling", "up", "window", "door", "glass ball", "spot", "many", "sun")


def light(seed):
    """Kind of light of the room of `seed`."""
    return LIGHTS[seed % len(LIGHTS)]


def material(draw, kinds):
    """MTL statements of a random material."""
    colour = " ".join(f"{draw.uniform(0.1, 0.85):.3f}" for _ in range(3))
    kind = draw.choice(kinds)
    rough = f"{draw.uniform(0.25, 0.8):.3f}"
    return {
        "diffuse": [f"Kd {colour}"],
        "plastic": [f"Kd {colour}", "Ks 0.04 0.04 0.04", "Ni 1.5", "illum 2", "Pm 0", f"Pr {rough}"],
        "varnish": [f"Kd {colour}", "Ks 0.04 0.04 0.04", "Ni 1.5", "illum 2", "Pm 0", "Pr 0"],
        "metal": [f"Kd {colour}", "Pm 1", f"Pr {rough}"],
        "mirror": ["Kd 0.9 0.9 0.9", "Pm 1", "Pr 0"],
        "glass": ["Kd 0 0 0", "Ni 1.5", "Tf 1 1 1", "illum 7"],
    }[kind]


def with_hole(mesh, name, x, height, depth, hole):
    """A wall of material `name` across the room at `x`, with a `hole` (z0, z1, y0, y1)."""
    z0, z1, y0, y1 = hole
    for low, high in (
        ((-0.1, -0.1), (z0, height + 0.1)), ((z1, -0.1), (depth + 0.1, height + 0.1)),
        ((z0, -0.1), (z1, y0)), ((z0, y1), (z1, height + 0.1)),
    ):
        if high[1] > low[1] and high[0] > low[0]:
            mesh.box(name, (x, low[1], low[0]), (x + 0.1, high[1], high[0]))


def ball(mesh, name, radius, centre):
    """A sphere of triangles with smooth normals."""
    lines = [line.split() for line in (SCENES / "shapes/sphere.obj").read_text().splitlines()]
    points = [tuple(map(float, line[1:])) for line in lines if line[:1] == ["v"]]
    for line in lines:
        if line[:1] == ["f"]:
            corners = [points[int(corner.split("/")[0]) - 1] for corner in line[1:]]
            mesh.face(name, [[c + radius * x for c, x in zip(centre, p)] for p in corners], corners)


def room(folder, seed):
    """Writes the room of `seed`; returns its scene file."""
    draw, folder = random.Random(seed), Path(folder)
    kind = light(seed)
    wide, high, deep = draw.uniform(3, 6), draw.uniform(2.4, 3.2), draw.uniform(3, 6)
    mesh, balls, scene = Mesh(), [], []
    far = wide + 3 if kind == "door" else wide
    opening = kind in ("window", "sun")
    faces = ["wall", "side", "end", None if opening else "end", "floor", "ceiling"]
    mesh.room(faces, (0, 0, 0), (far, high, deep))
    materials = {
        "wall": material(draw, ["diffuse"]), "side": material(draw, ["diffuse", "diffuse", "plastic"]),
        "end": material(draw, ["diffuse"]), "ceiling": ["Kd 0.8 0.8 0.78"],
        "floor": material(draw, ["diffuse", "plastic", "varnish", "metal"]),
    }
    warm = [1.0, draw.uniform(0.75, 1.0), draw.uniform(0.5, 0.9)]
    emitter = lambda radiance: ["Kd 0 0 0", "Ke " + " ".join(f"{radiance * w:.3f}" for w in warm)]
    middle_x, middle_z = wide * draw.uniform(0.35, 0.65), deep * draw.uniform(0.35, 0.65)

    def lamp(x, y, z, size, faces_up=False):
        corners = [(x - size, z - size), (x + size, z - size), (x + size, z + size), (x - size, z + size)]
        mesh.face("lamp", [(a, y, b) for a, b in (corners[::-1] if faces_up else corners)])

    if kind == "ceiling":
        lamp(middle_x, high - 0.02, middle_z, 0.3)
        materials["lamp"] = emitter(30)
    elif kind == "up":
        lamp(middle_x, 1.5, middle_z, 0.15, faces_up=True)
        mesh.box("wall", (middle_x - 0.16, 1.3, middle_z - 0.16), (middle_x + 0.16, 1.49, middle_z + 0.16))
        materials["lamp"] = emitter(150)
    elif kind in ("window", "sun"):
        width = draw.uniform(0.8, 1.6)
        with_hole(mesh, "end", wide, high, deep, (middle_z - width / 2, middle_z + width / 2, 0.9, 2.1))
        scene.append(f"[environment]\nradiance = {[5.0, 6.0, 8.0] if kind == 'window' else [0.6, 0.8, 1.1]}")
        if kind == "sun":
            scene.append(f"[[light]]\nkind = \"directional\"\ndirection = [-1, -0.6, {draw.uniform(-0.4, 0.4):.3f}]\nirradiance = [60, 54, 45]")
    elif kind == "door":
        with_hole(mesh, "side", wide, high, deep, (middle_z - 0.45, middle_z + 0.45, 0.0, 2.0))
        mesh.box("wall", (wide + 0.11, 0.01, middle_z - 0.44), (wide + 0.15, 1.99, middle_z + 0.44), turn=draw.uniform(15, 60))
        lamp(wide + 1.6, high - 0.02, middle_z, 0.4)
        materials["lamp"] = emitter(80)
    elif kind == "glass ball":
        lamp(middle_x, high - 0.5, middle_z, 0.04)
        materials["lamp"] = emitter(1500)
        materials["shade"] = material(draw, ["glass"])
        balls.append(("shade", 0.15, (middle_x, high - 0.5, middle_z)))
    elif kind == "spot":
        at = [draw.uniform(0.2, 0.8) * wide, draw.uniform(0.2, 1) * high, draw.uniform(0.2, 0.8) * deep]
        scene.append(
            f"[[light]]\nkind = \"spot\"\nposition = [{middle_x}, {high - 0.1}, {middle_z}]\nlook_at = {at}\n"
            f"intensity = {[round(60 * w, 3) for w in warm]}\nouter_degrees = {draw.uniform(12, 40):.1f}"
        )
    elif kind == "many":
        for _ in range(12):
            lamp(draw.uniform(0.1, 0.9) * wide, draw.uniform(0.5, 0.99) * high, draw.uniform(0.1, 0.9) * deep, 0.05)
        materials["lamp"] = emitter(100)

    kinds = ["diffuse"] * 4 + ["plastic", "plastic", "varnish", "metal", "metal", "mirror", "glass"]
    for i in range(draw.randint(4, 8)):
        name = f"thing{i}"
        materials[name] = material(draw, kinds)
        size = [draw.uniform(0.2, 0.9), draw.uniform(0.2, 1.2), draw.uniform(0.2, 0.9)]
        x, z = draw.uniform(0.4, wide - 1.2), draw.uniform(0.4, deep - 1.2)
        if draw.random() < 0.35:
            radius = 0.4 * size[0] + 0.1
            balls.append((name, radius, (x, radius + 0.001, z)))
        else:
            mesh.box(name, (x, 0.001, z), (x + size[0], size[1], z + size[2]), turn=draw.uniform(0, 45))

    name = f"room-{seed}"
    for key, radius, centre in balls:
        ball(mesh, key, radius, centre)
    mesh.write(folder / f"{name}.obj", f"{name}.mtl", f"A random room, {kind}.")
    text = "\n".join(f"newmtl {key}\n" + "\n".join(lines) + "\n" for key, lines in materials.items())
    (folder / f"{name}.mtl").write_text(text)
    eye = (draw.uniform(0.15, 0.3) * wide, draw.uniform(1.3, 1.8), draw.uniform(0.06, 0.12) * deep)
    scene.insert(0, f"[render]\nsize = [128, 128]\n\n[camera]\neye = {list(eye)}\n"
                 f"look_at = {[wide * draw.uniform(0.5, 0.7), 0.9, 0.8 * deep]}\nfov = 65\n\n[[mesh]]\nfile = \"{name}.obj\"")
    path = folder / f"{name}.toml"
    path.write_text("\n\n".join(scene) + "\n")
    return path


if __name__ == "__main__":
    for number in sys.argv[2:]:
        print(room(sys.argv[1], int(number)))
