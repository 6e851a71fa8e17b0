"""Lightmaps of the same charts: Cycles of Blender beside `halflight bake`.

    PYTHON tests/peers/bake_cycles.py [--program target/release/halflight] [--size 160x120] [--spp 1024] [MESH.obj]

PYTHON has the packages bpy (5.0.1 is for Python 3.11) and numpy. The materials of MESH.obj are diffuse surfaces and lamps
by Kd and Ke, and its texture coordinates are charts. Cycles bakes diffuse light without colour, irradiance / π, which is
`--unit white`. Texels are compared whose eight neighbours both programs have computed: the ratio of the means of each chart
is printed with two standard errors of ours, and the root mean square of the differences of texels, relative to the mean.
"""

import argparse
import subprocess
import tempfile
from pathlib import Path

import bpy
import numpy as np

ROOT = Path(__file__).resolve().parent.parent.parent


def read_pfm(path):
    with open(path, "rb") as file:
        channels = {b"PF": 3, b"Pf": 1}[file.readline().strip()]
        width, height = map(int, file.readline().split())
        order = "<" if float(file.readline()) < 0 else ">"
        # Rows begin at the bottom.
        return np.frombuffer(file.read(), order + "f4").reshape(height, width, channels).astype(np.float64)


def ours(program, mesh, size, spp, folder):
    command = [program, "bake", str(mesh), "--lightmap", "all", "--size", "x".join(map(str, size)), "--unit", "white"]
    # Samples of Cycles are spread over the texel.
    command += ["--supersample", "16", "--spp", str(max(spp // 16, 4))]
    files = ["-o", str(folder / "map.pfm"), "-o", str(folder / "map.exr"), "--error-map", str(folder / "error.pfm")]
    subprocess.run([*command, *files, "--pad", "0"], check=True, capture_output=True)
    coverage = bpy.data.images.load(str(folder / "map.exr"))
    coverage.alpha_mode = "CHANNEL_PACKED"
    is_computed = np.array(coverage.pixels[:]).reshape(size[1], size[0], 4)[:, :, 3] > 0.75
    # Half-widths are of luminance, at 2.262 standard errors.
    return read_pfm(folder / "map.pfm"), read_pfm(folder / "error.pfm")[:, :, 0] / 2.262, is_computed


def colours(mesh):
    """Kd and Ke of each material."""
    library, found, name = mesh.with_suffix(".mtl"), {}, None
    for words in map(str.split, library.read_text().splitlines()):
        if words[:1] == ["newmtl"]:
            name = words[1]
        elif words and words[0] in ("Kd", "Ke"):
            found.setdefault(name, {})[words[0]] = [*map(float, words[1:4]), 1.0]
    return found


def theirs(mesh, size, spp):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.wm.obj_import(filepath=str(mesh))
    image = bpy.data.images.new("map", *size, alpha=True, float_buffer=True)
    image.generated_color = (0.0, 0.0, 0.0, 0.0)
    objects = list(bpy.context.selected_objects)
    for name, colour in colours(mesh).items():
        material = bpy.data.materials.get(name)
        if material is None:
            continue
        material.use_nodes = True
        nodes, links = material.node_tree.nodes, material.node_tree.links
        nodes.clear()
        surface = nodes.new("ShaderNodeBsdfDiffuse")
        surface.inputs["Color"].default_value = colour.get("Kd", [0, 0, 0, 1])
        surface.inputs["Roughness"].default_value = 0.0
        if "Ke" in colour:
            surface = nodes.new("ShaderNodeEmission")
            surface.inputs["Color"].default_value = colour["Ke"]
            # Lamps emit from their fronts: strength 1 - backfacing.
            front = nodes.new("ShaderNodeMath")
            front.operation = "SUBTRACT"
            front.inputs[0].default_value = 1.0
            links.new(nodes.new("ShaderNodeNewGeometry").outputs["Backfacing"], front.inputs[1])
            links.new(front.outputs[0], surface.inputs["Strength"])
        links.new(surface.outputs[0], nodes.new("ShaderNodeOutputMaterial").inputs["Surface"])
        target = nodes.new("ShaderNodeTexImage")
        target.image = image
        nodes.active = target
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.cycles.device = "CPU"
    scene.cycles.samples = spp
    scene.cycles.use_adaptive_sampling = False
    scene.cycles.use_denoising = False
    scene.cycles.max_bounces = scene.cycles.diffuse_bounces = 64
    scene.cycles.sample_clamp_indirect = scene.cycles.sample_clamp_direct = 0.0
    scene.render.threads_mode, scene.render.threads = "FIXED", 1
    bpy.context.view_layer.objects.active = objects[0]
    bpy.ops.object.bake(type="DIFFUSE", pass_filter={"DIRECT", "INDIRECT"}, margin=0, use_clear=True)
    pixels = np.array(image.pixels[:], dtype=np.float64).reshape(size[1], size[0], 4)
    return pixels[:, :, :3], pixels[:, :, 3] > 0.5


def inner(mask):
    """Texels whose eight neighbours are in the mask."""
    padded = np.pad(mask, 1)
    rows, columns = mask.shape
    shifted = [padded[y : y + rows, x : x + columns] for y in range(3) for x in range(3)]
    return np.logical_and.reduce(shifted)


def charts(mask):
    """Connected parts of a mask, as lists of rows and of columns."""
    left = mask.copy()
    while left.any():
        stack, part = [tuple(np.argwhere(left)[0])], []
        left[stack[0]] = False
        while stack:
            y, x = stack.pop()
            part.append((y, x))
            for near in ((y - 1, x), (y + 1, x), (y, x - 1), (y, x + 1)):
                if all(0 <= a < side for a, side in zip(near, mask.shape)) and left[near]:
                    left[near] = False
                    stack.append(near)
        yield tuple(np.array(part).T)


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("mesh", nargs="?", type=Path, default=ROOT / "scenes" / "lightmap" / "room.obj")
    parser.add_argument("--program", default=str(ROOT / "target" / "release" / "halflight"))
    parser.add_argument("--size", default="160x120", type=lambda text: tuple(map(int, text.split("x"))))
    parser.add_argument("--spp", type=int, default=1024)
    arguments = parser.parse_args()
    weights = np.array([0.2126, 0.7152, 0.0722])
    with tempfile.TemporaryDirectory() as folder:
        our_map, error, is_computed = ours(arguments.program, arguments.mesh, arguments.size, arguments.spp, Path(folder))
    their_map, mask = theirs(arguments.mesh, arguments.size, arguments.spp)
    our_map, their_map = our_map @ weights, their_map @ weights
    # The fronts of lamps have no diffuse light in Cycles.
    mask = inner(mask & is_computed & (their_map > 0.0))
    print("| chart | texels | mean, theirs | ours over theirs | rms of the differences |")
    print("|---|---|---|---|---|")
    for number, part in enumerate(charts(mask)):
        a, b = our_map[part], their_map[part]
        noise = 200 * np.sqrt((error[part] ** 2).sum()) / a.sum()
        difference = np.sqrt(np.mean((a - b) ** 2)) / b.mean()
        print(f"| {number + 1} | {len(a)} | {b.mean():.4f} | {100 * (a.mean() / b.mean() - 1):+.2f} ± {noise:.2f} % "
              f"| {100 * difference:.1f} % |")


if __name__ == "__main__":
    main()
