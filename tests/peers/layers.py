"""Layers and attributes of our OpenEXR files, read by other programs.

    HALFLIGHT=target/quick/halflight python3 tests/peers/layers.py [--blender PYTHON]

The Python that runs this needs numpy 2, OpenEXR and OpenImageIO of PyPI; `exrheader` is that of Debian's `openexr`.
PYTHON is one with `bpy` 5, whose numpy is older. Every reader has to find the same channels, values and attributes, and
Blender's Cryptomatte node has to cut an object out as the coverage in the file does.
"""

import argparse
import json
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parent.parent.parent
SIZE = (160, 120)
OBJECT = "right ball"
PARTS = 16


def scene(folder):
    """Three balls on a floor, as objects; one of them is a mirror."""
    lines = ["mtllib scene.mtl"]
    count = 0

    def mesh(name, material, positions, faces):
        nonlocal count
        lines.extend([f"o {name}", f"usemtl {material}"])
        lines.extend("v {:.6f} {:.6f} {:.6f}".format(*p) for p in positions)
        lines.extend("f " + " ".join(str(count + 1 + i) for i in face) for face in faces)
        count += len(positions)

    def ball(name, material, middle, radius, rows=24, columns=48):
        positions, faces = [], []
        for row in range(rows + 1):
            for column in range(columns):
                a, b = np.pi * row / rows, 2 * np.pi * column / columns
                positions.append(middle + radius * np.array([np.sin(a) * np.sin(b), np.cos(a), np.sin(a) * np.cos(b)]))
        for row in range(rows):
            for column in range(columns):
                right = (column + 1) % columns
                a, b = row * columns, (row + 1) * columns
                faces.append([a + column, b + column, b + right, a + right])
        mesh(name, material, positions, faces)

    mesh("floor", "grey", [[-3, 0, -3], [-3, 0, 3], [3, 0, 3], [3, 0, -3]], [[0, 1, 2, 3]])
    mesh("lamp", "lamp", [[-1, 3, -1], [1, 3, -1], [1, 3, 1], [-1, 3, 1]], [[0, 1, 2, 3]])
    ball("left ball", "red", np.array([-1.1, 0.5, 0.0]), 0.5)
    ball("middle ball", "mirror", np.array([0.0, 0.5, 0.0]), 0.5)
    ball(OBJECT, "red", np.array([1.1, 0.5, 0.0]), 0.5)
    (folder / "scene.obj").write_text("\n".join(lines) + "\n")
    (folder / "scene.mtl").write_text(
        "newmtl grey\nKd 0.6 0.6 0.6\nnewmtl lamp\nKd 0 0 0\nKe 8 8 8\nnewmtl red\nKd 0.7 0.1 0.1\n"
        "newmtl mirror\nKd 0 0 0\nKs 0.9 0.9 0.9\nillum 3\nNs 1000\n"
    )


def render(program, folder):
    command = [program, "render", "scene.obj", "-o", "out.exr", "-o", "out.pfm", "--aov", "all", "--spp", "16"]
    command += ["--seed", "3", "--size", f"{SIZE[0]}x{SIZE[1]}", "--eye", "0,1.5,4.5", "--look-at", "0,0.5,0", "--json"]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=True)
    return json.loads(done.stdout)


def pfm(path):
    header, size, _, data = path.read_bytes().split(b"\n", 3)
    assert header == b"PF"
    width, height = map(int, size.split())
    return np.frombuffer(data, "<f4").reshape(height, width, 3)[::-1]


def by_openexr(path):
    import OpenEXR

    with OpenEXR.File(str(path), separate_channels=True) as file:
        parts = [{name: np.array(channel.pixels) for name, channel in part.channels.items()} for part in file.parts]
        return parts, dict(file.parts[0].header), [part.header.get("name") for part in file.parts]


def by_openimageio(path):
    import OpenImageIO as oiio

    channels, attributes = {}, {}
    for index in range(1 + PARTS):
        buffer = oiio.ImageBuf(str(path), index, 0)
        spec, pixels = buffer.spec(), buffer.get_pixels(oiio.FLOAT)
        channels |= {name: pixels[..., i] for i, name in enumerate(spec.channelnames)}
        attributes = {a.name: a.value for a in spec.extra_attribs} if index == 0 else attributes
    return channels, attributes


BLENDER = '''
import bpy, json, sys
path, name, out, width, height = sys.argv[-5:]
image = bpy.data.images.load(path)
result = {}
scene = bpy.context.scene
scene.render.resolution_x, scene.render.resolution_y = int(width), int(height)
scene.render.resolution_percentage = 100
tree = bpy.data.node_groups.new("matte", "CompositorNodeTree")
scene.compositing_node_group = tree
tree.interface.new_socket("Image", in_out="OUTPUT", socket_type="NodeSocketColor")
node = tree.nodes.new("CompositorNodeImage")
node.image = image
result["outputs"] = [socket.name for socket in node.outputs]
matte = tree.nodes.new("CompositorNodeCryptomatteV2")
matte.source = "IMAGE"
matte.image = image
names = [item.identifier for item in matte.bl_rna.properties["layer_name"].enum_items]
result["mattes"] = names
matte.layer_name = "CryptoObject"
matte.matte_id = name
output = tree.nodes.new("NodeGroupOutput")
tree.links.new(matte.outputs["Matte"], output.inputs[0])
scene.render.image_settings.file_format = "OPEN_EXR"
scene.render.image_settings.color_depth = "32"
scene.render.filepath = out
scene.view_settings.view_transform = "Raw"
camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
scene.collection.objects.link(camera)
scene.camera = camera
scene.render.engine = "CYCLES"
scene.cycles.samples = 1
bpy.ops.render.render(write_still=True)
print("RESULT " + json.dumps(result))
'''


def by_blender(python, path, folder):
    out = folder / "matte.exr"
    script = folder / "read.py"
    script.write_text(BLENDER)
    command = [python, str(script), str(path), OBJECT, str(out), *map(str, SIZE)]
    done = subprocess.run(command, capture_output=True, text=True)
    lines = [line for line in done.stdout.splitlines() if line.startswith("RESULT ")]
    if not lines:
        sys.exit(done.stdout[-2000:] + done.stderr[-2000:])
    return json.loads(lines[0][7:]), by_openexr(out)[0][0]


def check(what, is_right):
    print(f"{'ok' if is_right else 'MISS':5} {what}")
    return is_right


def matte(layers, name):
    """Coverage of an object by the channels and the manifest of the file."""
    import struct

    manifest = next(json.loads(v) for k, v in name[1].items() if k.endswith("/manifest") and name[0] in json.loads(v))
    number = struct.unpack("<f", struct.pack("<I", int(manifest[name[0]], 16)))[0]
    sum_of = np.zeros((SIZE[1], SIZE[0]), np.float32)
    for level in range(3):
        for number_of, fraction in (("R", "G"), ("B", "A")):
            ids = layers[f"CryptoObject{level:02}.{number_of}"]
            sum_of += np.where(ids == np.float32(number), layers[f"CryptoObject{level:02}.{fraction}"], 0)
    return sum_of


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--blender")
    arguments = parser.parse_args()
    program = os.path.abspath(os.environ.get("HALFLIGHT", ROOT / "target/release/halflight"))
    good = True
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        scene(folder)
        result = render(program, folder)
        picture, path = pfm(folder / "out.pfm"), folder / "out.exr"

        parts, attributes, names = by_openexr(path)
        beauty, layers = parts[0], {name: pixels for part in parts[1:] for name, pixels in part.items()}
        repeated = all(name.startswith(f"{part}.") for part, of in zip(names[1:], parts[1:]) for name in of)
        good &= check(f"OpenEXR: parts {' '.join(names)}", names[0] == "beauty" and repeated)
        good &= check("OpenEXR: the picture alone in part 0", sorted(beauty) == ["B", "G", "R"])
        good &= check("OpenEXR: bits of the picture", np.array_equal(np.stack([beauty[c] for c in "RGB"], -1), picture))
        good &= check(f"OpenEXR: {len(layers)} channels of layers", len(layers) == 46)
        relmse = attributes.get("relMSE")
        good &= check(f"OpenEXR: relMSE {relmse:.3e}", np.float32(result["error"]["relmse"]) == np.float32(relmse))
        for key in ("software", "command", "scene", "method", "seed", "samplesPerPixel", "renderTime", "capDate", "relMSEInterval"):
            good &= check(f"OpenEXR: {key} = {str(attributes.get(key))[:60]}", key in attributes)
        coverage = sum(layers[f"CryptoObject{i:02}.{c}"] for i in range(3) for c in "GA")
        inside = layers["depth.Z"] > 0
        print(f"      coverage of pixels with a surface: {coverage[inside].min():.4f} to {coverage[inside].max():.4f}")

        others, by_name = by_openimageio(path)
        same = all(np.array_equal(layers[channel], others.get(channel)) for channel in layers)
        good &= check(f"OpenImageIO: the same bits in {len(layers)} channels", same and len(others) == len(layers) + 3)
        good &= check("OpenImageIO: attributes", {"relMSE", "samplesPerPixel", "scene", "method"} <= set(by_name))

        if shutil.which("exrheader"):
            printed = subprocess.run(["exrheader", str(path)], capture_output=True, text=True).stdout
            wanted = ["relMSE (type float)", "samplesPerPixel (type int): 16", 'scene (type string): "scene.obj"', "albedo.R"]
            good &= check("exrheader: attributes and channels", all(text in printed for text in wanted))

        if arguments.blender:
            ours = matte(layers, (OBJECT, attributes))
            found, cut = by_blender(arguments.blender, path, folder)
            print("      Blender:", json.dumps(found)[:1500])
            cut = next(iter(cut.values())) if len(cut) == 1 else cut.get("R", next(iter(cut.values())))
            difference = np.abs(cut - ours).max()
            good &= check(f"Blender: matte of `{OBJECT}`, {ours.sum():.1f} pixels, largest difference {difference:.1e}", difference < 1e-5)
    sys.exit(0 if good else 1)


main()
