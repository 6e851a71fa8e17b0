"""Caustics: 1 / (relMSE x seconds of rendering) of our methods and of Mitsuba's, on scenes lit through mirrors and glass.

    python3 tests/peers/caustics.py [--seconds 4] [--seeds 5] [--reference-seconds 240] [scene ...]

Ours: `path` without and with photons of caustics, the latter with adaptive sampling as well, and `sppm`; Mitsuba's:
`path` and `ptracer`, `llvm_ad_rgb`, with our materials. Two threads, no limit of depth. Seconds are those of the processors, so that a busy machine tells the same.
Each renders for about `--seconds`: by the samples that a first, short picture says can be had in that time. All are measured against one reference, the mean of long pictures of our `path`
with photons by other seeds, whose remaining noise is subtracted; the mean of each over that of the reference is printed as well. Medians of the
seeds.
"""

import argparse
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
OURS = {
    "path, off": ["--method", "path", "--caustics", "off"],
    "path, caustics": ["--method", "path", "--caustics", "auto"],
    "path, adaptive": ["--method", "path", "--caustics", "auto", "--adaptive", "auto"],
    "sppm": ["--method", "sppm", "--audit", "off"],
}


def own_scene(size):
    """The caustic scene of this repository, with absolute paths."""
    folder = ROOT / "scenes"
    return {
        "render": {"size": list(size)},
        "mesh": [
            {"file": str(folder / "caustic" / "caustic.obj")},
            {
                "file": str(folder / "shapes" / "sphere.obj"),
                "scale": 0.5,
                "translate": [-0.5, 0.6, 0.5],
                "material": "ball",
            },
        ],
        "material.ball": {"kind": "glass", "ior": 1.5},
        "camera": {"eye": [0.3, 2.2, 4.6], "look_at": [0.1, 0.5, 0], "fov": 36},
    }


def ours(program, scene, extra, seed, spp):
    """The picture and its seconds, those of loading and building included."""
    with tempfile.TemporaryDirectory() as folder:
        picture = Path(folder) / "picture.exr"
        command = [program, "render", str(scene), "-o", str(picture), "--seed", str(seed), "--json"]
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


def budgeted(render, seconds):
    """Samples that `render`, a function of samples and seed, makes in so many seconds."""
    spp = 4
    while True:
        _, taken = render(spp, 0)
        if taken > 0.1 * seconds:
            return max(1, int(spp * seconds / taken))
        spp *= 4


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
    is_own = name == "caustic"
    description = own_scene(size) if is_own else published(name, size)
    toml = Path(folder) / f"{name}.toml"
    write_scene(toml, description)
    renderers = {who: lambda spp, seed, extra=extra: ours(program, toml, extra, seed, spp) for who, extra in OURS.items()}
    converged = reference(name, renderers["path, caustics"], arguments.reference_seconds)
    noise = relmse_of_noise(converged.variance(), converged.mean)
    if not is_own and not arguments.ours_only:
        scene = mitsuba_scene(description, folder)
        for kind in ("path", "ptracer"):
            integrator = mi.load_dict({"type": kind, "max_depth": -1})
            # The first render fills the kernel cache.
            theirs(scene, integrator, 0, 4)
            renderers[f"Mitsuba {kind}"] = lambda spp, seed, i=integrator: theirs(scene, i, seed, spp)
    best = None
    for who, render in renderers.items():
        spp = budgeted(render, arguments.seconds)
        runs = [render(spp, seed) for seed in range(1, arguments.seeds + 1)]
        values = [(max(relmse(picture, converged.mean) - noise, 1e-12), seconds) for picture, seconds in runs]
        mean = np.mean([picture.mean() for picture, _ in runs]) / converged.mean.mean()
        error, seconds = np.median(np.array(values), axis=0)
        efficiency = np.median([1 / (error * seconds) for error, seconds in values])
        best = efficiency if best is None else best
        row = f"| {name} | {who} | {spp} | {error:.3e} | {seconds:.2f} | {efficiency:.3g} | {efficiency / best:.3g} |"
        print(f"{row} {mean:.4f} |", flush=True)
    return f"{name}: noise of the reference {noise:.1e}"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="*", default=list(SCENES))
    parser.add_argument("--seconds", type=float, default=4.0)
    parser.add_argument("--seeds", type=int, default=5)
    parser.add_argument("--reference-seconds", type=float, default=240.0)
    parser.add_argument("--ours-only", action="store_true", help="without Mitsuba")
    arguments = parser.parse_args()
    program = workbench.halflight_program()
    print(f"{workbench.machine()}; about {arguments.seconds} s, medians of {arguments.seeds} seeds")
    print("| scene | method | spp | relMSE | seconds | 1/(relMSE s) | to our path | mean to reference |")
    print("|---|---|---|---|---|---|---|---|")
    with tempfile.TemporaryDirectory() as folder:
        notes = [compare(name, SCENES[name], arguments, program, folder) for name in arguments.scenes]
    print()
    print("\n".join(notes))


main()
