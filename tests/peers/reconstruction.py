"""The same samples raw and reconstructed beside a long reference: gain, told error over the true one, intervals.

    HALFLIGHT=program python3 tests/peers/reconstruction.py [--methods path,...] [--scenes NAME,...] [--rooms SEED ...]

Prints a row for each scene and method, and a summary of each method: films that are reconstructed, geometric mean
and least of the gain, told over true error, and how many intervals hold. References are pairs of pictures of other
seeds by a method without bias, kept in the output folder: in the product of the differences from both their noise
cancels. A third picture, reconstructed, gives the weights: noise of a reference makes those of dark pixels too large.
Rooms are those of random_rooms.py. Needs numpy, and the published scenes in HALFLIGHT_SCENES.
"""

import argparse
import json
import subprocess
import tempfile
from pathlib import Path

import numpy as np

from ablation import read_pfm
from methods import PROGRAM, ROOT, SCENES, reference_method, scene_file

OUTPUT = ROOT / "tests" / "output" / "reconstruction-weighted"
NEAR = (0.8, 1.25)


def render(scene, side, *flags):
    """The picture and the facts of `--json` of one render."""
    with tempfile.TemporaryDirectory() as folder:
        picture = Path(folder) / "picture.pfm"
        command = [PROGRAM, "render", str(scene), "--size", f"{side}x{side}", "--json", "-o", str(picture), *flags]
        done = subprocess.run(command, capture_output=True, text=True)
        if done.returncode not in (0, 3):
            raise RuntimeError(f"{command}: {done.stderr}")
        return read_pfm(picture), json.loads(done.stdout)


def reference(name, scene, a):
    """Two long pictures by a method that has no bias, and a reconstructed one for the weights of errors."""
    kept = OUTPUT / f"{name}-{a.side}.npz"
    if not kept.exists():
        by_light = reference_method(name) in ("bdpt", "vcm", "sppm")
        samples = a.reference_spp // 3 if by_light else a.reference_spp
        flags = ["--method", "bdpt" if by_light else "path", "--spp", str(samples)]
        pair = [render(scene, a.side, *flags, "--reconstruct", "off", "--seed", seed)[0] for seed in ("7000", "7001")]
        np.savez(kept, pair=pair, of_weights=render(scene, a.side, *flags, "--seed", "7002")[0])
    return np.load(kept)


def relmse(picture, reference):
    """relMSE against the pair of a reference, in whose product of differences its noise cancels."""
    (first, second), light = reference["pair"], reference["of_weights"]
    return float(np.mean((picture - first) * (picture - second) / (light**2 + 0.01 * np.mean(light) ** 2)))


def row(name, scene, method, reference, a):
    """Facts of one film."""
    flags = ["--method", method, "--spp", str(a.spp), "--seed", "3"]
    raw, _ = render(scene, a.side, *flags, "--reconstruct", "off")
    made, facts = render(scene, a.side, *flags)
    true, error = relmse(made, reference), facts["error"]
    low, high = error["interval"]
    found = {
        "scene": name, "method": method, "used": facts["findings"]["reconstruction"]["decision"] == "used",
        "raw": relmse(raw, reference), "reconstructed": true, "told": error["relmse"] / true,
        "low": low, "high": high, "holds": low <= true <= high,
    }
    (OUTPUT / f"{name}-{method}-{a.side}-{a.spp}.json").write_text(json.dumps(found, default=bool))
    return found


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--methods", default="path")
    parser.add_argument("--scenes", default=",".join(SCENES))
    parser.add_argument("--rooms", type=int, nargs="*", default=[])
    parser.add_argument("--side", type=int, default=96)
    parser.add_argument("--spp", type=int, default=32)
    parser.add_argument("--reference-spp", type=int, default=192)
    a = parser.parse_args()
    OUTPUT.mkdir(parents=True, exist_ok=True)
    names, rows = [*filter(None, a.scenes.split(",")), *(f"room-{seed}" for seed in a.rooms)], []
    print("| scene | method | raw | reconstructed | gain | told / true | 95 % interval |\n|---|---|---|---|---|---|---|")
    with tempfile.TemporaryDirectory() as folder:
        for name in names:
            scene = scene_file(name, folder)
            known = reference(name, scene, a)
            for method in a.methods.split(","):
                kept = OUTPUT / f"{name}-{method}-{a.side}-{a.spp}.json"
                found = json.loads(kept.read_text()) if kept.exists() else row(name, scene, method, known, a)
                rows.append(found)
                made = f"{found['reconstructed']:.1e}" if found["used"] else "the samples"
                interval = f"{found['low']:.1e} to {found['high']:.1e}" + ("" if found["holds"] else ", misses")
                print(f"| {name} | {method} | {found['raw']:.1e} | {made} | {found['raw'] / found['reconstructed']:.2f} | "
                      f"{found['told']:.2f} | {interval} |", flush=True)
    print("\n| method | used | gain | least gain | told / true | within .8 to 1.25 | intervals that hold, of all |\n"
          "|---|---|---|---|---|---|---|")
    for method in a.methods.split(","):
        all_films = [found for found in rows if found["method"] == method]
        used = [found for found in all_films if found["used"]]
        gains, told = (np.array(values) for values in ([found["raw"] / found["reconstructed"] for found in used],
                                                       [found["told"] for found in used]))
        if len(used):
            near = ((told > NEAR[0]) & (told < NEAR[1])).sum()
            held = sum(found["holds"] for found in used), sum(found["holds"] for found in all_films)
            print(f"| `{method}` | {len(used)} of {len(all_films)} | {np.exp(np.log(gains).mean()):.2f} | {gains.min():.2f} | "
                  f"{np.exp(np.log(told).mean()):.2f} | {near} | {held[0]} of {len(used)}, {held[1]} of {len(all_films)} |")


if __name__ == "__main__":
    main()
