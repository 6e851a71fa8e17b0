"""A room out of Blender's glTF exporter, by Cycles and by our program.

    HALFLIGHT=target/release/halflight PYTHON_OF_BPY tests/peers/cycles_room.py [--size 128] [--samples 1024]

The Python that runs this has `bpy` of PyPI. A room has a point, a spot and a sun lamp, a lamp of emissive triangles, a
ball of glass with a volume, a pane in front of a lamp, a metal, a coat and a mirror, and a camera. Cycles renders it,
Blender exports it, and our program renders the `.glb`. The table has the mean luminance of regions of both pictures.

Cycles knows no thin pane, so its pane is a box of glass 2 mm thick, which becomes one sheet before the export, as people
model windows for glTF. The spot has the soft edge that is usual in Blender.
"""

import argparse
import math
import os
import pathlib
import subprocess
import tempfile

import bpy
import numpy as np

ROOT = pathlib.Path(__file__).parents[2]
PROGRAM = os.environ.get("HALFLIGHT", str(ROOT / "target/release/halflight"))

EYE = (0.0, -1.95, 1.5)

# Regions of the picture: squares around points of the room, and half of their side in parts of the picture.
REGIONS = {
    "sun on the right wall": ((2, 0.45, 1.0), 0.03),
    "spot on the back wall": ((0.6, 2, 1.9), 0.03),
    "back wall": ((0.2, 2, 0.9), 0.03),
    "left wall": ((-2, 0.9, 1.5), 0.04),
    "right wall": ((2, 1.5, 2.3), 0.03),
    "ceiling": ((1.0, 1.2, 3), 0.03),
    "floor": ((0, 0.0, 0), 0.05),
    "lamp behind the pane": ((-1.3, 1.9, 2.2), 0.025),
    "ball of glass": ((-0.85, 0.6, 0.42), 0.035),
    "rough metal": ((0, 0.8, 0.42), 0.035),
    "coat": ((0.85, 0.6, 0.42), 0.035),
}


def material(name, color, metallic=0.0, roughness=1.0, level=0.0, transmission=0.0, emission=None):
    made = bpy.data.materials.new(name)
    made.use_nodes = True
    shader = made.node_tree.nodes["Principled BSDF"]
    values = {"Base Color": (*color, 1), "Metallic": metallic, "Roughness": roughness, "IOR": 1.5}
    values |= {"Specular IOR Level": level, "Transmission Weight": transmission}
    if emission:
        values |= {"Emission Color": (*emission, 1), "Emission Strength": 1.0}
    # The lobes of glTF scatter once; those of Blender scatter several times by default.
    shader.distribution = "GGX"
    for key, value in values.items():
        shader.inputs[key].default_value = value
    return made


def with_thickness(made, thickness):
    """The node by which Blender's exporter writes KHR_materials_volume."""
    group = bpy.data.node_groups.get("glTF Material Output")
    if not group:
        group = bpy.data.node_groups.new("glTF Material Output", "ShaderNodeTree")
        group.interface.new_socket("Thickness", in_out="INPUT", socket_type="NodeSocketFloat")
        group.nodes.new("NodeGroupInput")
    node = made.node_tree.nodes.new("ShaderNodeGroup")
    node.node_tree = group
    node.inputs["Thickness"].default_value = thickness


def mesh(name, made, positions, faces, smooth=False):
    data = bpy.data.meshes.new(name)
    data.from_pydata(positions, [], faces)
    data.materials.append(made)
    data.polygons.foreach_set("use_smooth", [smooth] * len(faces))
    data.update()
    made_object = bpy.data.objects.new(name, data)
    bpy.context.collection.objects.link(made_object)
    return made_object


def ball(name, made, middle, radius, rows=48):
    columns = 2 * rows
    positions = [(middle[0], middle[1], middle[2] + radius), (middle[0], middle[1], middle[2] - radius)]
    for row in range(1, rows):
        for column in range(columns):
            a, b = math.pi * row / rows, 2 * math.pi * column / columns
            at = (math.sin(a) * math.cos(b), math.sin(a) * math.sin(b), math.cos(a))
            positions.append(tuple(m + radius * x for m, x in zip(middle, at)))
    at = lambda row, column: 2 + (row - 1) * columns + column % columns
    faces = [(0, at(1, c), at(1, c + 1)) for c in range(columns)]
    faces += [(1, at(rows - 1, c + 1), at(rows - 1, c)) for c in range(columns)]
    for row in range(1, rows - 1):
        faces += [(at(row, c), at(row + 1, c), at(row + 1, c + 1), at(row, c + 1)) for c in range(columns)]
    return mesh(name, made, positions, faces, smooth=True)


def box(name, made, low, high):
    positions = [[(low, high)[i >> axis & 1][axis] for axis in range(3)] for i in range(8)]
    faces = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
    return mesh(name, made, positions, faces)


def lamp(kind, energy, location, towards=None, **keys):
    data = bpy.data.lights.new(kind, kind)
    data.energy = energy
    for key, value in keys.items():
        setattr(data, key, value)
    made = bpy.data.objects.new(kind, data)
    made.location = location
    if towards:
        from mathutils import Vector

        made.rotation_euler = (Vector(towards) - Vector(location)).to_track_quat("-Z", "Y").to_euler()
    bpy.context.collection.objects.link(made)


def room():
    """A room of 4 x 4 x 3 m with a hole in the ceiling for the sun; y goes into the picture."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    white = material("white", (0.7, 0.7, 0.7))
    red, green = material("red", (0.6, 0.1, 0.1)), material("green", (0.1, 0.5, 0.1))
    mesh("floor", white, [(-2, -2, 0), (2, -2, 0), (2, 2, 0), (-2, 2, 0)], [(0, 1, 2, 3)])
    mesh("back", white, [(-2, 2, 0), (2, 2, 0), (2, 2, 3), (-2, 2, 3)], [(0, 1, 2, 3)])
    mesh("front", white, [(-2, -2, 0), (-2, -2, 3), (2, -2, 3), (2, -2, 0)], [(0, 1, 2, 3)])
    mesh("left", red, [(-2, -2, 0), (-2, 2, 0), (-2, 2, 3), (-2, -2, 3)], [(0, 1, 2, 3)])
    mesh("right", green, [(2, -2, 0), (2, -2, 3), (2, 2, 3), (2, 2, 0)], [(0, 1, 2, 3)])
    # The hole in the ceiling spans -0.5 to 0.5.
    ceiling = [(x, y, 3) for y in (-2, -0.5, 0.5, 2) for x in (-2, -0.5, 0.5, 2)]
    cells = [(i + 4 * j, i + 4 * j + 4, i + 4 * j + 5, i + 4 * j + 1) for j in range(3) for i in range(3) if (i, j) != (1, 1)]
    mesh("ceiling", white, ceiling, cells)
    glow = material("glow", (0.0, 0.0, 0.0), emission=(6.0, 5.0, 4.0))
    mesh("lamp", glow, [(-1.6, 1.9, 1.9), (-1.0, 1.9, 1.9), (-1.0, 1.9, 2.5), (-1.6, 1.9, 2.5)], [(0, 1, 2, 3)])
    # The housing is black: Cycles finds no light of the other lamps through the pane.
    black, [left, right, low, high] = material("black", (0.0, 0.0, 0.0)), [-1.7, -0.9, 1.4, 2.6]
    corners = [(x, y, z) for y in (1.6, 1.95) for z in (low, high) for x in (left, right)]
    mesh("housing", black, corners, [(4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)])
    glass = material("glass", (1.0, 1.0, 1.0), roughness=0.0, level=0.5, transmission=1.0)
    with_thickness(glass, 0.7)
    ball("glass ball", glass, (-0.85, 0.6, 0.42), 0.35)
    metal = material("metal", (0.9, 0.6, 0.3), metallic=1.0, roughness=0.5, level=0.5)
    ball("metal ball", metal, (0.0, 0.8, 0.42), 0.35)
    coat = material("coat", (0.2, 0.3, 0.6), roughness=0.4, level=0.5)
    ball("coated ball", coat, (0.85, 0.6, 0.42), 0.35)
    pane = material("pane", (1.0, 1.0, 1.0), roughness=0.0, level=0.5, transmission=1.0)
    box("pane", pane, (-1.7, 1.6, 1.4), (-0.9, 1.602, 2.6))
    lamp("POINT", 60.0, (1.2, -0.5, 2.3), shadow_soft_size=0.0)
    spot = {"spot_size": math.radians(24), "spot_blend": 0.15, "shadow_soft_size": 0.0}
    lamp("SPOT", 400.0, (0.0, -1.5, 2.4), (0.6, 2.0, 1.9), **spot)
    lamp("SUN", 4.0, (0, 0, 6), (6, 1.2, 0), angle=0.0)
    camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    camera.data.angle = math.radians(90)
    camera.location, camera.rotation_euler = EYE, (math.radians(90), 0, 0)
    bpy.context.collection.objects.link(camera)
    scene = bpy.context.scene
    scene.camera, scene.world = camera, bpy.data.worlds.new("black")
    scene.world.use_nodes = True
    scene.world.node_tree.nodes["Background"].inputs["Strength"].default_value = 0.0


def by_cycles(size, samples, seed, file):
    scene = bpy.context.scene
    scene.render.engine, scene.cycles.device = "CYCLES", "CPU"
    scene.render.resolution_x = scene.render.resolution_y = size
    scene.render.resolution_percentage = 100
    cycles = {"samples": samples, "seed": seed, "use_adaptive_sampling": False, "use_denoising": False}
    cycles |= {"sample_clamp_direct": 0.0, "sample_clamp_indirect": 0.0, "blur_glossy": 0.0, "pixel_filter_type": "BOX"}
    cycles |= {"caustics_reflective": True, "caustics_refractive": True, "use_light_tree": True}
    bounces = ["max_bounces", "diffuse_bounces", "glossy_bounces", "transmission_bounces", "transparent_max_bounces"]
    for key, value in (cycles | dict.fromkeys(bounces, 64)).items():
        setattr(scene.cycles, key, value)
    settings = scene.render.image_settings
    settings.file_format, settings.color_depth = "OPEN_EXR", "32"
    scene.render.filepath = str(file)
    bpy.ops.render.render(write_still=True)


def exported(file):
    box = bpy.data.objects["pane"].data
    made = box.materials[0]
    bpy.data.objects.remove(bpy.data.objects["pane"])
    mesh("pane", made, [(-1.7, 1.601, 1.4), (-0.9, 1.601, 1.4), (-0.9, 1.601, 2.6), (-1.7, 1.601, 2.6)], [(0, 1, 2, 3)])
    bpy.ops.export_scene.gltf(filepath=str(file), export_lights=True, export_cameras=True)


def pixels(file):
    image = bpy.data.images.load(str(file), check_existing=False)
    image.colorspace_settings.name = "Non-Color"
    width, height = image.size
    values = np.empty(width * height * 4, dtype=np.float32)
    image.pixels.foreach_get(values)
    return values.reshape(height, width, 4)[::-1, :, :3] @ np.array([0.2126, 0.7152, 0.0722])


def table(theirs, ours, size):
    """Means of regions, and the noise of their difference by that of the two seeds in each pixel."""
    print("| region | Cycles | halflight | difference | its noise |\n|---|---|---|---|---|")
    rows = [("whole picture", (slice(None), slice(None)))]
    for name, ((x, y, z), half) in REGIONS.items():
        depth = 2 * (y - EYE[1])
        middle = (0.5 - (z - EYE[2]) / depth, 0.5 + (x - EYE[0]) / depth)
        rows.append((name, tuple(slice(*(round(size * (m + h)) for h in (-half, half))) for m in middle)))
    for name, region in rows:
        squares = sum(((a[region] - b[region]) ** 2).sum() for a, b in (theirs, ours))
        their_mean, our_mean = (np.mean([picture[region] for picture in pictures]) for pictures in (theirs, ours))
        noise = math.sqrt(squares) / 2 / theirs[0][region].size / their_mean
        off = our_mean / their_mean - 1
        print(f"| {name} | {their_mean:.4f} | {our_mean:.4f} | {100 * off:+.2f} % | {100 * noise:.2f} % |")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--size", type=int, default=128)
    parser.add_argument("--samples", type=int, default=1024)
    parser.add_argument("--keep", type=pathlib.Path, help="folder for the files")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        folder = arguments.keep or pathlib.Path(folder)
        folder.mkdir(exist_ok=True)
        room()
        theirs = []
        for seed in (1, 2):
            by_cycles(arguments.size, arguments.samples // 2, seed, folder / f"cycles{seed}.exr")
            theirs.append(pixels(folder / f"cycles{seed}.exr"))
        exported(folder / "room.glb")
        ours = []
        for seed in (1, 2):
            to = folder / f"halflight{seed}.exr"
            command = [PROGRAM, "render", folder / "room.glb", "-o", to, "--method", "path"]
            # Cycles has no caustics of lamps without a size.
            command += ["--reconstruct", "off", "--caustics", "off", "--reuse", "off"]
            options = ["--seed", seed, "--spp", arguments.samples // 2, "--size", f"{arguments.size}x{arguments.size}"]
            subprocess.run([*map(str, command + options)], check=True)
            ours.append(pixels(to))
        table(theirs, ours, arguments.size)


if __name__ == "__main__":
    main()
