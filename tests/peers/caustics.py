"""Caustics: 1 / (relMSE x seconds of rendering) of our methods and of Mitsuba's, on scenes lit through mirrors and glass.

    python3 tests/peers/caustics.py [scene ...] [--seconds 3 10 30] [--seeds 5] [--reference-seconds 240]

Ours: `path` without and with photons of caustics, and `sppm`; Mitsuba's:
`path` and `ptracer`, `llvm_ad_rgb`, with our materials; where `LUXCORE` names the python of a virtual environment with
`pyluxcore` and `numpy`, LuxCore's `BIDIRVMCPU` and `PATHCPU` with its caustic cache, with several radii, on scenes that it has the
words for.
Two threads, no limit of depth. Seconds are those of the processors, so that a busy machine tells the same.
Each renders for about `--seconds`, or for each of several: by the samples that a first, short picture says can be had in that time.
Ratios hang on it, for what no path finds is missing from `path` without photons however long it takes. All are measured against one
reference, the mean of long pictures of our `path` with photons by other seeds, whose remaining noise is subtracted; the mean of each over
that of the reference is printed as well. Medians of the seeds.
"""

import argparse
import json
import os
import resource
import subprocess
import tempfile
import time
from pathlib import Path

import workbench
from measure import Sums, relmse, relmse_of_noise
from mitsuba_scene import mitsuba_scene
from published import published
from scene_file import write_scene
from wavefront import read_obj
from workbench import ROOT, dr, mi, np

WIDTH = 256
SCENES = {
    "torus": (256, 192),
    "water-caustic": (256, 256),
    "caustic-glass": (176, 252),
    "lux-causticcube": (256, 154),
    "caustic": (256, 256),
}
FIRST_REFERENCE_SEED = 1000
# Pictures that a reference is the mean of: their differences tell its noise.
REFERENCE_PICTURES = 8
LUX_METHODS = ("BiDirVM", "caustic cache")
# Radii of LuxCore's merging, and of the lookups of its caustic cache, in diagonals of the scene: the best differs by scene.
LUX_RADII = (0.0005, 0.0015, 0.005)
OURS = {
    "path, off": ["--method", "path", "--caustics", "off"],
    "path, caustics": ["--method", "path", "--caustics", "auto"],
    "sppm": ["--method", "sppm", "--audit", "off"],
}


def baked(path, out, scale=1.0, translate=(0.0, 0.0, 0.0), material=None):
    """An OBJ file written to `out` in triangles, scaled and moved, all of one material where that is said."""
    lines = [] if material is None else [f"mtllib {material}.mtl", f"usemtl {material}"]
    for line in path.read_text().splitlines():
        kind, *words = line.split() or [""]
        if kind == "v":
            lines.append(" ".join(["v", *(repr(scale * float(x) + by) for x, by in zip(words, translate))]))
        elif kind == "f":
            lines += [f"f {words[0]} {words[i]} {words[i + 1]}" for i in range(1, len(words) - 1)]
        elif kind == "mtllib" and material is None:
            lines.append(f"mtllib {Path(path.parent, *words)}")
        elif kind == "vn" or kind == "usemtl" and material is None:
            lines.append(line)
    out.write_text("\n".join(lines) + "\n")
    return str(out)


def own_scene(size, folder):
    """The caustic scene of this repository as peers want it."""
    scenes, folder = ROOT / "scenes", Path(folder)
    (folder / "ball.mtl").write_text("newmtl ball\nKd 0 0 0\nTf 1 1 1\nNi 1.5\nillum 7\n")
    ball = baked(scenes / "shapes" / "sphere.obj", folder / "ball.obj", 0.5, (-0.5, 0.6, 0.5), "ball")
    return {
        "render": {"size": list(size)},
        "mesh": [{"file": baked(scenes / "caustic" / "caustic.obj", folder / "box.obj")}, {"file": ball}],
        "camera": {"eye": [0.3, 2.2, 4.6], "look_at": [0.1, 0.5, 0], "up": [0, 1, 0], "fov": 36},
    }


def ours(program, scene, extra, seed, spp):
    """The picture and its seconds, those of loading and building included."""
    with tempfile.TemporaryDirectory() as folder:
        picture = Path(folder) / "picture.exr"
        command = [program, "render", "--reconstruct", "off", str(scene), "-o", str(picture), "--seed", str(seed), "--json"]
        command += ["--threads", str(workbench.THREADS), "--spp", str(spp), *extra]
        before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
        done = subprocess.run(command, capture_output=True, text=True)
        if done.returncode != 0:
            raise RuntimeError(f"{' '.join(command)}\n{done.stderr}")
        seconds = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before
        pixels = np.array(mi.Bitmap(str(picture)).convert(mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.Float32, False))
        return pixels.astype(np.float64), seconds


def theirs(scene, integrator, seed, spp):
    start = time.process_time()
    picture = mi.render(scene, integrator=integrator, spp=spp, seed=seed)
    dr.eval(picture)
    dr.sync_thread()
    return np.array(picture).astype(np.float64), time.process_time() - start


def lux_surface(said):
    """A material of an MTL file in LuxCore's words; `None` where it has none for it."""
    kind = int(said.get("illum", [1])[0])
    surfaces = {1: ("diffuse", said.get("Kd", [0.0] * 3)), 3: ("mirror", said.get("Ks")), 7: ("glass", said.get("Ni", [1.5])[0])}
    if kind not in surfaces:
        return None
    surface = dict([surfaces[kind]])
    return surface | {"emission": said["Ke"]} if any(said.get("Ke", [0.0])) else surface


def lux_scene(description, path):
    """Writes what LuxCore has to know of a scene; `None` where it has other words than ours for a surface or a lamp."""
    meshes = []
    for mesh in description["mesh"]:
        parts, materials = read_obj(Path(mesh["file"]))
        for part in parts:
            normals = None if part.normals is None else part.normals.tolist()
            shape = {"positions": part.positions.tolist(), "faces": part.faces.tolist(), "normals": normals}
            meshes.append(shape | {"material": lux_surface(materials[part.material])})
    lights = description.get("light", [])
    if any(light["kind"] != "directional" for light in lights) or any(mesh["material"] is None for mesh in meshes):
        return None
    corners = np.vstack([mesh["positions"] for mesh in meshes])
    diagonal = float(np.linalg.norm(corners.max(0) - corners.min(0)))
    said = {"size": description["render"]["size"], "camera": description["camera"], "meshes": meshes, "lights": lights}
    path.write_text(json.dumps(said | {"diagonal": diagonal}))
    return path


def luxcore(scene, method, radius, seconds, seed):
    """LuxCore's picture after so many seconds; loading is not counted."""
    with tempfile.TemporaryDirectory() as folder:
        picture = Path(folder) / "picture.npy"
        program = Path(__file__).with_name("luxcore_peer.py")
        command = [os.environ["LUXCORE"], program, scene, method, radius, seconds, seed, picture]
        done = subprocess.run([str(word) for word in command], capture_output=True, text=True)
        if done.returncode != 0:
            raise RuntimeError(done.stderr)
        return np.load(picture).astype(np.float64), float(done.stdout.split()[-1])


def budgeted(render, seconds):
    """Samples that `render`, a function of samples and seed, makes in so many seconds."""
    spp = 4
    while True:
        _, taken = render(spp, 0)
        if taken > 0.1 * seconds:
            return max(1, int(spp * seconds / taken))
        spp *= 4


def measured(render, spp, seeds, converged, noise):
    """Medians of relMSE, seconds and efficiency of pictures by the first `seeds`, and the mean of these over that of the reference."""
    runs = [render(spp, seed) for seed in range(1, seeds + 1)]
    values = [(max(relmse(picture, converged.mean) - noise, 1e-12), seconds) for picture, seconds in runs]
    error, seconds, efficiency = np.median([(error, seconds, 1 / (error * seconds)) for error, seconds in values], axis=0)
    return error, seconds, efficiency, np.mean([picture.mean() for picture, _ in runs]) / converged.mean.mean()


def reference(name, render, seconds):
    """`Sums` of long pictures, kept in the output folder."""
    path = workbench.OUTPUT / "references" / f"{name}-caustics.npz"
    path.parent.mkdir(parents=True, exist_ok=True)
    sums = Sums()
    if path.exists():
        kept = np.load(path)
        sums.count, sums.mean, sums.squares = int(kept["count"]), kept["mean"], kept["squares"]
        if sums.count == REFERENCE_PICTURES:
            return sums
    spp = budgeted(render, seconds / REFERENCE_PICTURES)
    while sums.count < REFERENCE_PICTURES:
        picture, _ = render(spp, FIRST_REFERENCE_SEED + sums.count)
        sums.add(picture)
        np.savez(path, count=sums.count, mean=sums.mean, squares=sums.squares)
    return sums


def compare(name, size, arguments, program, folder):
    description = own_scene(size, folder) if name == "caustic" else published(name, size)
    toml = Path(folder) / f"{name}.toml"
    write_scene(toml, description)
    renderers = {who: lambda spp, seed, extra=extra: ours(program, toml, extra, seed, spp) for who, extra in OURS.items()}
    converged = reference(name, renderers["path, caustics"], arguments.reference_seconds)
    noise = relmse_of_noise(converged.variance(), converged.mean)
    if not arguments.ours_only:
        scene = mitsuba_scene(description, folder)
        for kind in ("path", "ptracer"):
            integrator = mi.load_dict({"type": kind, "max_depth": -1})
            # The first render fills the kernel cache.
            theirs(scene, integrator, 0, 4)
            renderers[f"Mitsuba {kind}"] = lambda spp, seed, i=integrator: theirs(scene, i, seed, spp)
    if "LUXCORE" in os.environ and not arguments.ours_only:
        lux = lux_scene(description, Path(folder) / f"{name}.json")
        for kind, radius in ((kind, radius) for kind in LUX_METHODS for radius in LUX_RADII) if lux else ():
            who = f"LuxCore {kind}, {radius}"
            renderers[who] = lambda seconds, seed, kind=kind, radius=radius: luxcore(lux, kind, radius, seconds, seed)
    first = next(iter(renderers))
    chosen = {who: render for who, render in renderers.items() if who == first or (arguments.only or "") in who}
    for wanted in arguments.seconds:
        off = None
        for who, render in chosen.items():
            # LuxCore is told the seconds themselves.
            spp = wanted if who.startswith("LuxCore") else budgeted(render, wanted)
            error, seconds, efficiency, mean = measured(render, spp, arguments.seeds, converged, noise)
            off = efficiency if off is None else off
            row = f"| {name} | {who} | {spp} | {error:.3e} | {seconds:.2f} | {efficiency:.3g} | {efficiency / off:.3g} |"
            print(f"{row} {mean:.4f} |", flush=True)
    return f"{name}: noise of the reference {noise:.1e}"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="*", default=list(SCENES))
    parser.add_argument("--seconds", type=float, nargs="+", default=[4.0])
    parser.add_argument("--seeds", type=int, default=5)
    parser.add_argument("--reference-seconds", type=float, default=240.0)
    parser.add_argument("--ours-only", action="store_true", help="without peers")
    parser.add_argument("--only", help="beside our path only methods whose name has this in it")
    arguments = parser.parse_args()
    program = workbench.halflight_program()
    print(f"{workbench.machine()}; about {', '.join(map(str, arguments.seconds))} s, medians of {arguments.seeds} seeds")
    print("| scene | method | spp | relMSE | seconds | 1/(relMSE s) | to our path | mean to reference |")
    print("|---|---|---|---|---|---|---|---|")
    with tempfile.TemporaryDirectory() as folder:
        notes = [compare(name, SCENES[name], arguments, program, folder) for name in arguments.scenes]
    print()
    print("\n".join(notes))


if __name__ == "__main__":
    main()
