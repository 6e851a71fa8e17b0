"""Processor seconds of a picture in 1 to 64 shards, from measured parts.

    HALFLIGHT=program python3 tests/peers/shards.py [--spp 32] [--size 256x192] [--methods path ...] [scene]

A shard takes b + r / N processor seconds: b is repeated by each, r is divided. Both are fitted to shards of 1, 8 and 64,
one thread each; a merge, m + n N, to those of 1 and 8 files. A row gives the seconds of one shard with the merge, and the
part of all processor seconds that is repeated. More shards stop paying where twice as many save less than a tenth of
the elapsed time.
"""

import argparse
import os
import resource
import subprocess
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent.parent
PROGRAM = os.environ.get("HALFLIGHT", str(ROOT / "target" / "release" / "halflight"))
MEASURED = [1, 8, 64]
COUNTS = [1, 2, 4, 8, 16, 32, 64]
LEAST_GAIN = 0.1


def seconds(*arguments):
    """Processor seconds of the program."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
    subprocess.run([PROGRAM, *arguments], check=True, capture_output=True)
    return resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before


def line(points):
    """Intercept and slope through points (x, y) by least squares of relative errors, neither below 0."""
    weights = [1 / max(y, 1e-3) ** 2 for _, y in points]
    total = sum(weights)
    x0 = sum(w * x for w, (x, _) in zip(weights, points)) / total
    y0 = sum(w * y for w, (_, y) in zip(weights, points)) / total
    slope = sum(w * (x - x0) * (y - y0) for w, (x, y) in zip(weights, points))
    slope = max(slope / sum(w * (x - x0) ** 2 for w, (x, _) in zip(weights, points)), 0)
    return max(y0 - slope * x0, 0), slope


def measure(scene, method, arguments, folder):
    """Parts b and r of a shard, and m and n of a merge."""
    render = ["render", scene, "--method", method, "--spp", str(arguments.spp), "--size", arguments.size, "--threads", "1"]
    shards = []
    for count in MEASURED:
        parts = range(1, count + 1) if count == MEASURED[1] else range(1, count + 1, max(1, count // 4))
        for part in parts:
            film = f"{folder}/{method}-{count}-{part}.film"
            shards.append((1 / count, seconds(*render, "--shard", f"{part}/{count}", "--checkpoint", film)))
    merges = []
    for count in MEASURED[:2] * 3:
        files = [f"{folder}/{method}-{count}-{part}.film" for part in range(1, count + 1)]
        merges.append((count, seconds("merge", *files, "-o", f"{folder}/merged.exr")))
    return *line(shards), *line(merges)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scene", nargs="?", default=str(ROOT / "scenes/cornell/cornell.obj"))
    parser.add_argument("--spp", type=int, default=32)
    parser.add_argument("--size", default="256x192")
    parser.add_argument("--methods", nargs="+", default=["path", "irradiance-cache", "bdpt"])
    arguments = parser.parse_args()
    print("| method | b, s | r, s | m, s | n, s |" + "".join(f" {count} |" for count in COUNTS) + " stops paying |")
    print("|---" * (6 + len(COUNTS)) + "|")
    with tempfile.TemporaryDirectory() as folder:
        for method in arguments.methods:
            repeated, divided, merge, file = measure(arguments.scene, method, arguments, folder)
            elapsed = [repeated + divided / count + merge + file * count for count in COUNTS]
            cells = [f" {t:.2f} ({repeated / (repeated + divided / n):.0%}) |" for n, t in zip(COUNTS, elapsed)]
            gains = [1 - after / before for before, after in zip(elapsed, elapsed[1:])]
            end = next((n for n, gain in zip(COUNTS, gains) if gain < LEAST_GAIN), "beyond 64")
            print(f"| {method} | {repeated:.3f} | {divided:.2f} | {merge:.3f} | {file:.3f} |{''.join(cells)} {end} |", flush=True)


if __name__ == "__main__":
    main()
