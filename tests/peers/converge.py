"""Does `sppm` go to the picture of the path tracer, and as fast as theory says?

With a = 2/3 the noise and the squared blur of progressive photon mapping both fall as n^(-2/3) (Knaus and Zwicker 2011), so
that relMSE against time is a line of slope -2/3 in logarithms. The slope is fitted to the rounds of several renders, each
compared with a path traced picture of another seed. Then Welch's test asks of blocks of the picture, for lots of seeds of
both, whether their means differ: of blocks because single pixels on edges are blurred longest.
"""

import argparse
import json
import subprocess
import tempfile
from pathlib import Path

from workbench import ROOT, THREADS, halflight_program, mi, np  # first: it enters the environment

from measure import Sums, two_sided_p, welch

THEORY = -2 / 3
TOLERANCE = 0.15
SIGNIFICANCE = 0.01


def render(program, scene, method, spp, seed, size, folder, reference=None):
    picture = Path(folder) / f"{method}-{seed}.exr"
    command = [program, "render", "--reconstruct", "off", scene, "-o", picture, "--method", method, "--spp", spp, "--seed", seed]
    command += ["--size", f"{size}x{size}", "--threads", THREADS, "--audit", "off", "--json"]
    if reference:
        command += ["--reference", reference]
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True)
    if done.returncode != 0:
        raise RuntimeError(done.stderr)
    return picture, json.loads(done.stdout)


def read(picture):
    return np.array(mi.Bitmap(str(picture)).convert(mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.Float32), dtype=np.float64)


def blocks(picture, side):
    height, width, channels = picture.shape
    return picture.reshape(height // side, side, width // side, side, channels).mean(axis=(1, 3))


def slope(history, first, noise):
    """Of log relMSE against log seconds, at samples that grow by a quarter; `noise` is that of the reference."""
    rounds = [(r["spp"], r["seconds"], r["reference"]["relmse"] - noise) for r in history if r["reference"]]
    points, wanted = [], float(first)
    for spp, seconds, relmse in rounds:
        if spp >= wanted and relmse > 0:
            points.append((np.log(seconds), np.log(relmse)))
            wanted = 1.25 * spp
    return np.polyfit(*np.array(points).T, 1)[0]


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--scene", default=ROOT / "scenes" / "cornell" / "cornell.obj")
    parser.add_argument("--size", type=int, default=64)
    parser.add_argument("--spp", type=int, default=1024, help="samples of each sppm render")
    parser.add_argument("--reference-spp", type=int, default=16384, help="of each path traced picture")
    parser.add_argument("--lots", type=int, default=4, help="seeds of each")
    parser.add_argument("--first", type=int, default=16, help="samples from which the slope is fitted")
    arguments = parser.parse_args()
    program = halflight_program()
    truth, found, slopes = Sums(), Sums(), []
    with tempfile.TemporaryDirectory() as folder:
        for seed in range(arguments.lots):
            path = (program, arguments.scene, "path", arguments.reference_spp, 1000 + seed, arguments.size, folder)
            reference, told = render(*path)
            truth.add(blocks(read(reference), 8))
            sppm = (program, arguments.scene, "sppm", arguments.spp, seed, arguments.size, folder)
            picture, run = render(*sppm, reference=reference)
            found.add(blocks(read(picture), 8))
            slopes.append(slope(run["history"], arguments.first, told["error"]["relmse"]))
            print(f"seed {seed}: slope {slopes[-1]:.3f}", flush=True)
    mean, error = np.mean(slopes), np.std(slopes, ddof=1) / np.sqrt(len(slopes))
    print(f"slope {mean:.3f} +- {error:.3f}, by theory {THEORY:.3f}: off by {100 * abs(mean / THEORY - 1):.0f} %")
    t, freedom = welch(found, truth, 1e-12)
    p = two_sided_p(t, freedom)
    level = SIGNIFICANCE / p.size
    print(f"blocks: {p.size} values, least p {p.min():.2e}, {np.count_nonzero(p < level)} below {level:.1e}")
    print(f"mean: {100 * (found.mean.mean() / truth.mean.mean() - 1):+.3f} %")
    good = abs(mean / THEORY - 1) <= TOLERANCE and np.all(p >= level)
    print("as theory says" if good else "NOT as theory says")
    return 0 if good else 1


if __name__ == "__main__":
    raise SystemExit(main())
