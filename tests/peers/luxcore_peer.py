"""One picture by LuxCore, in a virtual environment of its own (`pip install pyluxcore numpy`): its libraries and Mitsuba's
do not share a process. `caustics.py` starts it where `LUXCORE` names the python of such an environment.

    python luxcore_peer.py scene.json method radius seconds seed picture.npy

The scene is what `lux_scene` of caustics.py wrote, the radius that of photons or of merging, in diagonals of the scene. Prints the seconds of the processors that rendering took; the picture is
(height, width, 3), linear.
"""

import json
import math
import os
import sys
import time

import numpy as np
import pyluxcore

THREADS = 2
METHODS = {
    "BiDirVM": {"renderengine.type": "BIDIRVMCPU"},
    "caustic cache": {
        "renderengine.type": "PATHCPU",
        "path.photongi.sampler.type": "METROPOLIS",
        "path.photongi.photon.maxcount": 1000000,
        "path.photongi.photon.maxdepth": 8,
        "path.photongi.caustic.enabled": 1,
        "path.photongi.caustic.maxsize": 200000,
        "path.photongi.caustic.updatespp": 8,
    },
}


def properties(values):
    made = pyluxcore.Properties()
    for key, value in values.items():
        made.Set(pyluxcore.Property(key, list(value) if isinstance(value, (list, tuple)) else [value]))
    return made


def material(name, said):
    key = f"scene.materials.{name}"
    if "glass" in said:
        return {f"{key}.type": "glass", f"{key}.interiorior": said["glass"], f"{key}.kr": [1, 1, 1], f"{key}.kt": [1, 1, 1]}
    if "mirror" in said:
        return {f"{key}.type": "mirror", f"{key}.kr": said["mirror"]}
    made = {f"{key}.type": "matte", f"{key}.kd": said["diffuse"]}
    if "emission" in said:
        made |= {f"{key}.emission": said["emission"], f"{key}.emission.power": 0.0}
    return made


def lux_scene(said):
    scene = pyluxcore.Scene()
    width, height = said["size"]
    fov = said["camera"]["fov"]
    if width > height:  # its field of view is that of the longer side
        fov = 2 * math.degrees(math.atan(math.tan(math.radians(fov) / 2) * width / height))
    values = {
        "scene.camera.type": "perspective",
        "scene.camera.lookat.orig": said["camera"]["eye"],
        "scene.camera.lookat.target": said["camera"]["look_at"],
        "scene.camera.up": said["camera"]["up"],
        "scene.camera.fieldofview": fov,
    }
    for i, mesh in enumerate(said["meshes"]):
        normals = [tuple(n) for n in mesh["normals"]] if mesh["normals"] else None
        points, faces = [tuple(p) for p in mesh["positions"]], [tuple(f) for f in mesh["faces"]]
        scene.DefineMesh(f"mesh{i}", points, faces, normals, None, None, None)
        values |= material(f"material{i}", mesh["material"])
        values |= {f"scene.objects.o{i}.shape": f"mesh{i}", f"scene.objects.o{i}.material": f"material{i}"}
    for i, light in enumerate(said["lights"]):
        key = f"scene.lights.l{i}"
        values |= {
            f"{key}.type": "sharpdistant",
            f"{key}.direction": light["direction"],
            f"{key}.color": light["irradiance"],
        }
    scene.Parse(properties(values))
    return scene


def main():
    file, method, radius, seconds, seed, out = sys.argv[1:]
    with open(file) as text:
        said = json.load(text)
    width, height = said["size"]
    if METHODS[method].get("path.photongi.caustic.enabled"):
        METHODS[method]["path.photongi.caustic.lookup.radius"] = float(radius) * said["diagonal"]
    else:  # in radii of the sphere around the scene
        METHODS[method]["bidirvm.startradius.scale"] = 2 * float(radius)
    config = {
        "film.width": width,
        "film.height": height,
        "film.filter.type": "NONE",
        "film.imagepipelines.0.0.type": "NOP",
        "native.threads.count": THREADS,
        "renderengine.seed": int(seed) + 1,
        "sampler.type": "SOBOL",
        "path.pathdepth.total": 32,
        "path.pathdepth.diffuse": 16,
        "path.pathdepth.glossy": 16,
        "path.pathdepth.specular": 32,
        "light.maxdepth": 32,
        **METHODS[method],
    }
    pyluxcore.Init(lambda message: None)
    session = pyluxcore.RenderSession(pyluxcore.RenderConfig(properties(config), lux_scene(said)))
    start = time.process_time()
    session.Start()
    while time.process_time() - start < float(seconds):
        time.sleep(0.02)
        session.UpdateStats()
    session.Stop()
    taken = time.process_time() - start
    pixels = np.zeros((height, width, 3), dtype=np.float32)
    session.GetFilm().GetOutputFloat(pyluxcore.FilmOutputType.RGB_IMAGEPIPELINE, pixels, 0)
    np.save(out, pixels[::-1])
    print(taken, flush=True)
    # Its libraries do not always survive their own end.
    os._exit(0)


main()
