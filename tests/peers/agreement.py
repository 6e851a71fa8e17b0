"""The same picture? A z-test against Mitsuba, pixel by pixel, on scenes that both can say exactly.

    python3 tests/peers/agreement.py [--seeds 48] [--spp 64] [scene ...]

Both path tracers render each scene of `tests/peers/scenes` with many seeds; the means of a pixel are compared
by Welch's t with the variances that the seeds show. Passes where at least 99.75 % of the values are not
significant at 1 % after Sidak's correction for the number of pixels (the criterion of Mitsuba's own tests) and
the means of the pictures differ by no more than 0.5 %. A failure leaves pictures in `tests/output/peers`.
"""

import argparse
import sys
import tomllib

import workbench
from make_scenes import FOLDER
from measure import Sums, two_sided_p, welch
from mitsuba_scene import mitsuba_scene
from workbench import mi, np, write_picture

SIGNIFICANCE = 0.01
PIXELS_THAT_PASS = 0.9975
MEAN_TOLERANCE = 0.005
# Sums of float32 radiance in another order: what a pixel without noise (a lamp, black) may be off, relatively.
ROUNDING = 1e-5
BLOCK = 12


def compare(name, arguments, program):
    """One row of the table, and whether the scene passes."""
    toml = FOLDER / f"{name}.toml"
    scene = mitsuba_scene(tomllib.loads(toml.read_text()), FOLDER)
    ours, theirs = Sums(), Sums()
    our_means, their_means = Sums(), Sums()
    our_blocks, their_blocks = Sums(), Sums()
    for seed in range(1, arguments.seeds + 1):
        picture, _ = workbench.halflight(program, toml, arguments.spp, seed)
        for sums, value in ((ours, picture), (our_means, picture.mean()), (our_blocks, blocks(picture))):
            sums.add(value)
        picture = np.array(mi.render(scene, spp=arguments.spp, seed=seed)).astype(np.float64)
        for sums, value in ((theirs, picture), (their_means, picture.mean()), (their_blocks, blocks(picture))):
            sums.add(value)
    t, freedom = welch(ours, theirs, floor(theirs.mean))
    p = two_sided_p(t, freedom)
    pixels = p.shape[0] * p.shape[1]
    passing = np.mean(p > 1 - (1 - SIGNIFICANCE) ** (1 / pixels))
    off = our_means.mean / their_means.mean - 1
    off_error = np.sqrt(our_means.variance() + their_means.variance()) / their_means.mean
    block_t, _ = welch(our_blocks, their_blocks, floor(their_blocks.mean))
    worst = np.unravel_index(np.argmax(np.abs(block_t)), block_t.shape)
    worst_off = our_blocks.mean[worst] / their_blocks.mean[worst] - 1
    fine = bool(passing >= PIXELS_THAT_PASS and abs(off) <= MEAN_TOLERANCE)
    print(
        f"| {name} | {100 * passing:.2f} % | {100 * off:+.3f} ± {100 * off_error:.3f} % | {np.sqrt(np.mean(t**2)):.2f} "
        f"| {100 * worst_off:+.2f} % ({block_t[worst]:+.1f}) | {'pass' if fine else '**FAIL**'} |",
        flush=True,
    )
    if not fine or arguments.pictures:
        leave_pictures(name, ours.mean, theirs.mean, p)
    return fine


def floor(mean):
    return (ROUNDING * mean) ** 2 + 1e-20


def blocks(picture):
    """Means over square blocks: where a small bias shows that single pixels hide."""
    height, width = (n // BLOCK * BLOCK for n in picture.shape[:2])
    return picture[:height, :width].reshape(height // BLOCK, BLOCK, width // BLOCK, BLOCK, 3).mean(axis=(1, 3))


def leave_pictures(name, ours, theirs, p):
    folder = workbench.OUTPUT / "agreement"
    write_picture(folder / f"{name}-ours.exr", ours)
    write_picture(folder / f"{name}-theirs.exr", theirs)
    write_picture(folder / f"{name}-both.png", np.hstack([ours, theirs]) / (2 * theirs.mean()))
    # Black: p = 1; white: 1e-10 or less.
    write_picture(folder / f"{name}-p.png", np.clip(-np.log10(np.maximum(p, 1e-300)) / 10, 0, 1))
    relative = (ours - theirs) / (theirs + 0.05 * theirs.mean())
    write_picture(folder / f"{name}-relative.png", np.clip(0.2 + 2 * relative, 0, 1))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="*", default=sorted(path.stem for path in FOLDER.glob("*.toml")))
    parser.add_argument("--seeds", type=int, default=48)
    parser.add_argument("--spp", type=int, default=64)
    parser.add_argument("--pictures", action="store_true", help="leave pictures of what passes, too")
    arguments = parser.parse_args()
    program = workbench.halflight_program()
    print(f"{workbench.machine()}; {arguments.seeds} seeds of {arguments.spp} spp")
    print("| scene | values that pass | our mean against theirs | rms t | worst block (t) | |\n|---|---|---|---|---|---|")
    results = [compare(name, arguments, program) for name in arguments.scenes]
    print(f"{sum(results)} of {len(results)} pass")
    sys.exit(0 if all(results) else 1)


main()
