"""pbrt-v3 and halflight on the same scenes: 1 / (relMSE x seconds) of bdpt, mlt and sppm.

    PBRT=.../pbrt HALFLIGHT_SCENES=... python3 tests/peers/pbrt3.py [scene ...] [--seconds 30] [--seeds 3]

Both programs render the geometry, camera and lights of a published scene, with materials that both have
exactly: glass stays, every other material becomes diffuse, of its `Kd` or of 0.5 where that is a texture or
black. One reference, by our `path` and `bdpt` at many samples, judges both. One thread each, seconds of the processor.
"""

import argparse
import json
import os
import re
import statistics
import subprocess
import tempfile
from pathlib import Path

import numpy as np

from scene_file import write_scene
from smallvcm import ours, processor_seconds, read_pfm, relmse, report, samples_for
from wavefront import read_obj

DEPTH = 12
SCENES = {"veach-bidir": (256, 256), "veach-door": (320, 180), "caustic-glass": (176, 252)}
PBRT = {
    "bdpt": 'Integrator "bdpt" "integer maxdepth" [{depth}]',
    "mlt": 'Integrator "mlt" "integer maxdepth" [{depth}] "integer mutationsperpixel" [{count}]',
    "path": 'Integrator "path" "integer maxdepth" [{depth}] "float rrthreshold" [0]',
}


def colour(material):
    """The diffuse reflectance that both programs give the material."""
    kd = material.get("Kd", [0.5] * 3)
    return [0.5] * 3 if "map_Kd" in material or max(kd) <= 0 else kd


def is_glass(material):
    return material.get("illum") == [7.0]


def simple_mtl(materials):
    lines = []
    for name, material in materials.items():
        lines.append(f"newmtl {name}")
        if is_glass(material):
            lines += ["Kd 0 0 0", "Tf 1 1 1", f"Ni {material['Ni'][0]}", "illum 7"]
        else:
            lines.append("Kd " + " ".join(map(repr, colour(material))))
            if "Ke" in material:
                lines.append("Ke " + " ".join(map(repr, material["Ke"])))
    return "\n".join(lines) + "\n"


def numbers(array):
    return " ".join(f"{x:.8g}" for x in np.asarray(array).reshape(-1))


def pbrt_world(parts, materials):
    """Meshes and materials in pbrt's words."""
    lines = ["WorldBegin"]
    for part in parts:
        material = materials[part.material]
        lines.append("AttributeBegin")
        if is_glass(material):
            lines.append(f'Material "glass" "float eta" [{material["Ni"][0]}]')
        else:
            lines.append(f'Material "matte" "rgb Kd" [{numbers(colour(material))}]')
            if max(material.get("Ke", [0])) > 0:
                lines.append(f'AreaLightSource "diffuse" "rgb L" [{numbers(material["Ke"])}]')
        normals = f'"normal N" [{numbers(part.normals)}]' if part.normals is not None else ""
        lines += [f'Shape "trianglemesh" "point P" [{numbers(part.positions)}] {normals} '
                  f'"integer indices" [{" ".join(map(str, part.faces.reshape(-1)))}]', "AttributeEnd"]
    return "\n".join([*lines, "WorldEnd", ""])


def prepared(name, folder):
    """The scene as `scene.toml` and as `world.pbrt` in `folder`, and its camera in pbrt's words."""
    source = Path(os.environ["HALFLIGHT_SCENES"]) / name
    parts, materials = read_obj(source / f"{name}.obj")
    text = (source / f"{name}.obj").read_text()
    (folder / "mesh.obj").write_text(re.sub(r"^mtllib .*$", "mtllib mesh.mtl", text, flags=re.M))
    (folder / "mesh.mtl").write_text(simple_mtl(materials))
    (folder / "world.pbrt").write_text(pbrt_world(parts, materials))
    camera, (width, height) = json.loads((source / f"{name}.json").read_text())["camera"], SCENES[name]
    view = {"eye": camera["origin"], "look_at": camera["target"], "up": camera["up"], "fov": camera["vfov"]}
    write_scene(folder / "scene.toml", {
        "render": {"size": [width, height], "max_depth": DEPTH},
        "mesh": [{"file": str(folder / "mesh.obj")}],
        "camera": view,
    })
    # pbrt's `fov` is that of the shorter side.
    narrow = view["fov"] if width >= height else 2 * np.degrees(
        np.arctan(np.tan(np.radians(view["fov"]) / 2) * width / height))
    return "\n".join([
        "Scale -1 1 1",
        f"LookAt {numbers(view['eye'])} {numbers(view['look_at'])} {numbers(view['up'])}",
        f'Camera "perspective" "float fov" [{narrow}]',
        f'Film "image" "integer xresolution" [{width}] "integer yresolution" [{height}] '
        '"string filename" "theirs.pfm"',
        'PixelFilter "box" "float xwidth" [0.5] "float ywidth" [0.5]',
    ])


def theirs(camera, method, count, folder):
    """pbrt's picture and its seconds: `count` samples a pixel, or mutations of mlt."""
    lines = [camera, f'Sampler "random" "integer pixelsamples" [{count}]',
             PBRT[method].format(depth=DEPTH - 1, count=count), 'Include "world.pbrt"', ""]
    (folder / "theirs.pbrt").write_text("\n".join(lines))
    command = [os.environ["PBRT"], "--nthreads", "1", "--quiet", "theirs.pbrt"]
    spent, _ = processor_seconds(command, cwd=folder)
    return read_pfm(folder / "theirs.pfm"), spent


def counts_for(camera, method, seconds, folder):
    """Samples or mutations a pixel that take about `seconds`; all of pbrt's pictures have other numbers by count."""
    few, many = (theirs(camera, method, n, folder)[1] for n in (2, 10))
    each = max((many - few) / 8, 1e-3)
    return max(2, round((seconds - max(few - 2 * each, 0)) / each))


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("scenes", nargs="*", default=list(SCENES))
    parser.add_argument("--seconds", type=float, default=30)
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--reference-seconds", type=float, default=600)
    parser.add_argument("--ours", nargs="*", default=("path", "path --caustics off", "bdpt", "vcm", "mlt"))
    parser.add_argument("--theirs", nargs="*", default=("path", "bdpt", "mlt"))
    arguments = parser.parse_args()
    for name in arguments.scenes:
        with tempfile.TemporaryDirectory() as folder:
            folder = Path(folder)
            camera = prepared(name, folder)
            scene = folder / "scene.toml"
            print(f"\n{name}: {arguments.seconds} s of one thread, {SCENES[name]}", flush=True)
            spp = samples_for(scene, "bdpt", arguments.reference_seconds, folder)
            truth = ours(scene, "bdpt", spp, 1000, folder)[0]
            for method in arguments.theirs:
                count = counts_for(camera, method, arguments.seconds, folder)
                runs = [theirs(camera, method, count + seed, folder) for seed in range(arguments.seeds)]
                report("pbrt-v3", f"{method} ({count})", truth, runs)
            for method in arguments.ours:
                spp = samples_for(scene, method, arguments.seconds, folder)
                runs = [ours(scene, method, spp, seed, folder)[:2] for seed in range(arguments.seeds)]
                report("halflight", f"{method} ({spp})", truth, runs)


if __name__ == "__main__":
    main()
