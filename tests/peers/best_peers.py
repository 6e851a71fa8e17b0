"""Pictures of `auto` and of peers after the same time, on public scenes: the ratio of their efficiencies.

    HALFLIGHT=program HALFLIGHT_SCENES=folder python3 tests/peers/best_peers.py [scene ...] [--seconds 10] [--seeds 1]

Ours: `--method auto` for the given seconds of one thread. Mitsuba: `path` and `ptracer`, `llvm_ad_rgb`, by the
samples that it makes in these seconds of the processor.
LuxCore, where `LUXCORE` names the python of a virtual environment that has it, and where it has the words for a
scene: `BIDIRVMCPU` and `PATHCPU` with its caustic cache, with three radii each. All of 128 x 128 pixels, judged
by the references of `methods.py`. Efficiency is 1 / (relMSE x seconds).
"""

import argparse
import os
import resource
import tempfile
from pathlib import Path

import workbench
from caustics import LUX_METHODS, LUX_RADII, budgeted, luxcore, lux_scene, theirs
from measure import relmse_of_pair
from methods import SIZE, reference, render
from mitsuba_scene import mitsuba_scene
from published import published
from scene_file import write_scene
from workbench import mi, np

SCENES = [
    "cornell-box-bitterli", "cbox-mitsuba", "living-room", "staircase", "sponza-dabrovic", "veach-door", "veach-bidir",
    "lux-causticcube", "torus", "caustic-glass", "water-caustic",
]
REFERENCE_SECONDS = 60


def flipped(run):
    """The picture of a peer, whose first row is the upper one, with its rows from below, and its seconds."""
    picture, seconds = run
    return picture[::-1], seconds


def ours(scene, seconds, seed):
    """The picture and the processor seconds, those of loading and building included."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
    picture, facts = render(scene, ["--time", f"{seconds}s", "--seed", str(seed)])
    return picture, resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before, facts["method"]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="*", default=SCENES)
    parser.add_argument("--seconds", type=float, default=10.0)
    parser.add_argument("--seeds", type=int, default=1)
    a = parser.parse_args()
    print(f"{workbench.machine()}; {a.seconds:g} s of one thread\n")
    print("| scene | program | relMSE | seconds | mean over reference | efficiency of auto over it |")
    print("|---|---|---|---|---|---|")
    with tempfile.TemporaryDirectory() as folder:
        for name in a.scenes:
            compare(name, a, folder)


def compare(name, a, folder):
    """Rows of a scene."""
    description = published(name, SIZE)
    toml = Path(folder) / f"{name}.toml"
    write_scene(toml, description)
    pair = reference(name, toml, REFERENCE_SECONDS)

    def measured(runs):
        """Geometric mean of relMSE, mean seconds, mean of the pictures over that of the reference."""
        errors = [max(relmse_of_pair(picture, pair), 1e-9) for picture, _ in runs]
        mean = np.mean([picture.mean() for picture, _ in runs]) / pair.mean()
        return float(np.exp(np.mean(np.log(errors)))), float(np.mean([seconds for _, seconds in runs])), mean

    seeds = range(1, a.seeds + 1)
    runs = [ours(toml, a.seconds, seed) for seed in seeds]
    own = measured([run[:2] for run in runs])
    row(name, "auto: " + ", ".join(sorted({run[2] for run in runs})), own, own)
    scene = mitsuba_scene(description, folder)
    for kind in ("path", "ptracer"):
        integrator = mi.load_dict({"type": kind, "max_depth": -1})
        # The first render fills the kernel cache.
        theirs(scene, integrator, 0, 4)
        spp = budgeted(lambda spp, seed, i=integrator: theirs(scene, i, seed, spp), a.seconds)
        row(name, f"Mitsuba {kind}", measured([flipped(theirs(scene, integrator, seed, spp)) for seed in seeds]), own)
    lux = lux_scene(description, Path(folder) / f"{name}.json") if "LUXCORE" in os.environ else None
    for kind, radius in ((kind, radius) for kind in LUX_METHODS for radius in LUX_RADII) if lux else ():
        # LuxCore runs on two threads.
        runs = [flipped(luxcore(lux, kind, radius, a.seconds / 2, seed)) for seed in seeds]
        row(name, f"LuxCore {kind}, {radius}", measured(runs), own)


def row(name, who, values, own):
    """Prints a row of the table."""
    error, seconds, mean = values
    ratio = error * seconds / (own[0] * own[1])
    print(f"| {name} | {who} | {error:.2e} | {seconds:.1f} | {mean:.4f} | {ratio:.2f} |", flush=True)


if __name__ == "__main__":
    main()
