"""Pictures per second: 1 / (relMSE x seconds of rendering) of our path tracer over that of Mitsuba's.

    python3 tests/peers/efficiency.py [--spp 64] [--seeds 9] [--reference-spp 4096] [scene ...]

Both render 256 x 256 with two threads, without a limit of depth, in turns. Mitsuba: `path`, `llvm_ad_rgb`,
`multijitter`, the source BSDFs, timed after a first render that fills its kernel cache. Ours: the
`seconds.render` of `--json`. Each is measured against its own converged picture, whose remaining noise is
subtracted; how far the two converged pictures are apart is printed beside.
"""

import argparse
import tempfile
import time
from pathlib import Path

import workbench
from measure import Sums, relmse, relmse_of_noise, welch
from mitsuba_scene import mitsuba_scene
from published import published
from scene_file import write_scene
from workbench import dr, mi, np

SIZE = (256, 256)
SCENES = ["cornell-box-bitterli", "veach-ajar", "living-room"]
# References use seeds that no measurement uses.
FIRST_REFERENCE_SEED = 1000
REFERENCE_CHUNK = 256


def mitsuba_render(scene, spp, seed):
    """The picture and the seconds it took."""
    start = time.perf_counter()
    picture = mi.render(scene, spp=spp, seed=seed)
    dr.eval(picture)
    dr.sync_thread()
    seconds = time.perf_counter() - start
    return np.array(picture).astype(np.float64), seconds


def halflight_render(program, scene, spp, seed):
    picture, facts = workbench.halflight(program, scene, spp, seed)
    return picture, facts["seconds"]["render"]


def reference(name, who, spp, render):
    """`Sums` of a converged picture, kept in the output folder: rendered in chunks, resumed after a stop."""
    path = workbench.OUTPUT / "references" / f"{name}-{who}-{SIZE[0]}x{SIZE[1]}.npz"
    path.parent.mkdir(parents=True, exist_ok=True)
    sums = Sums()
    if path.exists():
        kept = np.load(path)
        sums.count, sums.mean, sums.squares = int(kept["count"]), kept["mean"], kept["squares"]
    while sums.count * REFERENCE_CHUNK < spp:
        picture, _ = render(REFERENCE_CHUNK, FIRST_REFERENCE_SEED + sums.count)
        sums.add(picture)
        np.savez(path, count=sums.count, mean=sums.mean, squares=sums.squares)
    return sums


def compare(name, arguments, program, folder):
    description = published(name, SIZE)
    toml = Path(folder) / f"{name}.toml"
    write_scene(toml, description)
    scene = mitsuba_scene(description, folder, source=True)
    renderers = {
        "halflight": lambda spp, seed: halflight_render(program, toml, spp, seed),
        "mitsuba": lambda spp, seed: mitsuba_render(scene, spp, seed),
    }
    references = {who: reference(name, who, arguments.reference_spp, r) for who, r in renderers.items()}
    mitsuba_render(scene, arguments.spp, 0)
    rows = {who: [] for who in renderers}
    for seed in range(1, arguments.seeds + 1):
        for who, render in renderers.items():
            picture, seconds = render(arguments.spp, seed)
            converged = references[who]
            error = relmse(picture, converged.mean) - relmse_of_noise(converged.variance(), converged.mean)
            rows[who].append((error, seconds, 1 / (error * seconds)))
    medians = {who: np.median(np.array(values), axis=0) for who, values in rows.items()}
    for who, (error, seconds, efficiency) in medians.items():
        paths = SIZE[0] * SIZE[1] * arguments.spp / seconds / 1e6
        print(f"| {name} | {who} | {error:.3e} | {seconds:.3f} | {paths:.2f} | {efficiency:.1f} | ", end="")
        ratio = medians["halflight"][2] / medians["mitsuba"][2]
        print(f"**{ratio:.2f}** |" if who == "halflight" else "1 |", flush=True)
    return f"{name}: {difference(references['halflight'], references['mitsuba'])}"


def difference(ours, theirs):
    """How far two converged pictures are apart, and how far their noise alone would bring them."""
    noise = relmse_of_noise(ours.variance() + theirs.variance(), theirs.mean)
    apart = relmse(ours.mean, theirs.mean)
    t, _ = welch(ours, theirs, 1e-16)
    far = np.mean(np.abs(t) > 4)
    means = ours.mean.mean() / theirs.mean.mean()
    return (
        f"ratio of means {means:.4f}, relMSE between them {apart:.2e} (noise alone {noise:.2e}), "
        f"{100 * far:.2f} % of values more than 4 deviations apart"
    )


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="*", default=SCENES)
    parser.add_argument("--spp", type=int, default=64)
    parser.add_argument("--seeds", type=int, default=9)
    parser.add_argument("--reference-spp", type=int, default=4096)
    parser.add_argument("--mitsuba-references-only", action="store_true", help="prepare them and stop")
    arguments = parser.parse_args()
    if arguments.mitsuba_references_only:
        for name in arguments.scenes:
            scene = mitsuba_scene(published(name, SIZE), ".", source=True)
            reference(name, "mitsuba", arguments.reference_spp, lambda spp, seed: mitsuba_render(scene, spp, seed))
        return
    program = workbench.halflight_program()
    print(f"{workbench.machine()}; {arguments.spp} spp, medians of {arguments.seeds} seeds")
    print("| scene | renderer | relMSE | seconds | Mpaths/s | 1/(relMSE s) | ratio |\n|---|---|---|---|---|---|---|")
    with tempfile.TemporaryDirectory() as folder:
        notes = [compare(name, arguments, program, folder) for name in arguments.scenes]
    print("\nConverged pictures, ours against theirs:")
    print("\n".join(notes))


main()
