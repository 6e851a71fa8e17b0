"""Pictures and error curves of all methods on four scenes of the repository, for docs/methods.md.

    HALFLIGHT=program python3 tests/peers/gallery.py [--seconds 8] [--reference-seconds 240]

Writes docs/gallery/methods-SCENE.png, three rows of pictures after the same time, in the order of METHODS, and
methods-SCENE.svg, relMSE against seconds. References are long pictures of another seed. Needs numpy.
"""

import argparse
import csv
import math
import os
import struct
import subprocess
import tempfile
import zlib
from pathlib import Path

import numpy as np

from measure import relmse
from smallvcm import read_pfm

ROOT = Path(__file__).resolve().parent.parent.parent
PROGRAM = os.environ.get("HALFLIGHT", str(ROOT / "target" / "release" / "halflight"))
GALLERY = ROOT / "docs" / "gallery"
KEPT = ROOT / "tests" / "output" / "gallery"
METHODS = ["path", "irradiance-cache", "radiance-cache", "photon-map", "sppm", "light", "bdpt", "vcm", "instant-radiosity",
           "mlt", "auto"]
COLOURS = ["#000", "#d00", "#f77", "#a60", "#e80", "#0a0", "#06c", "#60c", "#888", "#c0a", "#0aa"]
COLUMNS = 4
SCENES = {"cornell": ("scenes/cornell/cornell.obj", "path"), "two-rooms": ("scenes/two-rooms/two-rooms.toml", "path"),
          "caustic": ("scenes/caustic/caustic.toml", "path"), "glossy": ("scenes/glossy/glossy.toml", "path")}
SIDE = 192


def render(scene, *flags):
    command = [PROGRAM, "render", "--reconstruct", "off", str(ROOT / scene), "--size", f"{SIDE}x{SIDE}", *map(str, flags)]
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode not in (0, 3):
        raise RuntimeError(f"{command}: {done.stderr}")


def write_png(path, picture):
    """Linear RGB, rows from the top, by the sRGB curve."""
    picture = np.clip(picture, 0, 1)
    picture = np.where(picture <= 0.0031308, 12.92 * picture, 1.055 * picture ** (1 / 2.4) - 0.055)
    height, width, _ = picture.shape
    rows = np.zeros((height, 1 + 3 * width), np.uint8)
    rows[:, 1:] = np.round(255 * picture).astype(np.uint8).reshape(height, -1)

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    header = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    png = chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(rows.tobytes(), 9)) + chunk(b"IEND", b"")
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + png)


def write_curves(path, curves):
    """relMSE against seconds, both logarithmic."""
    points = [point for curve in curves.values() for point in curve]
    x0, x1 = (f(math.log10(x) for x, _ in points) for f in (min, max))
    y0, y1 = (f(math.log10(y) for _, y in points) for f in (min, max))
    at = lambda x, y: (50 + 400 * (math.log10(x) - x0) / (x1 - x0), 20 + 280 * (y1 - math.log10(y)) / (y1 - y0))
    text = ['<svg xmlns="http://www.w3.org/2000/svg" width="620" height="340" font-family="sans-serif" font-size="12">',
            '<rect width="620" height="340" fill="#fff"/>']
    for decade in range(math.ceil(y0), math.floor(y1) + 1):
        y = at(1, 10.0**decade)[1]
        text += [f'<line x1="50" x2="450" y1="{y:.1f}" y2="{y:.1f}" stroke="#ddd"/>',
                 f'<text x="45" y="{y + 4:.1f}" text-anchor="end">1e{decade}</text>']
    for seconds in (0.1, 0.3, 1, 3, 10):
        if x0 <= math.log10(seconds) <= x1:
            x = at(seconds, 1)[0]
            text += [f'<line x1="{x:.1f}" x2="{x:.1f}" y1="20" y2="300" stroke="#ddd"/>',
                     f'<text x="{x:.1f}" y="316" text-anchor="middle">{seconds:g} s</text>']
    for i, (method, curve) in enumerate(curves.items()):
        line = " ".join("{:.1f},{:.1f}".format(*at(*point)) for point in curve)
        text += [f'<polyline points="{line}" fill="none" stroke="{COLOURS[i]}" stroke-width="1.5"/>',
                 f'<text x="465" y="{40 + 22 * i}" fill="{COLOURS[i]}">{method} {curve[-1][1]:.1e}</text>']
    path.write_text("\n".join([*text, "</svg>", ""]))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seconds", type=float, default=8)
    parser.add_argument("--reference-seconds", type=float, default=240)
    arguments = parser.parse_args()
    KEPT.mkdir(parents=True, exist_ok=True)
    for name, (scene, truth) in SCENES.items():
        reference = KEPT / f"{name}.pfm"
        if not reference.exists():
            render(scene, "--method", truth, "--time", f"{arguments.reference_seconds}s", "--seed", 1000, "-o", reference)
        right = read_pfm(reference)
        exposure = 0.8 / np.quantile(right, 0.95)
        rows, curves = [], {}
        with tempfile.TemporaryDirectory() as folder:
            for method in METHODS:
                picture, report = Path(folder) / "picture.pfm", Path(folder) / method
                # Without an audit `auto` has no biased choices.
                audit = [] if method == "auto" else ["--audit", "off"]
                stop = ["--time", f"{arguments.seconds}s", *audit, "--caustics", "auto"]
                render(scene, "--method", method, *stop, "--reference", reference, "--report", report, "-o", picture)
                rows.append(read_pfm(picture))
                # The last row of the curve may be a round before the end.
                end = (arguments.seconds, relmse(rows[-1], right))
                with open(report / "curve.csv") as file:
                    points = [(float(row["seconds"]), float(row["reference_relmse"])) for row in csv.DictReader(file)]
                curves[method] = [point for point in points if min(point) > 0 and point[0] < 0.95 * end[0]] + [end]
                print(f"{name} {method}: relMSE {curves[method][-1][1]:.2e}", flush=True)
        rows += [np.zeros_like(rows[0])] * (-len(rows) % COLUMNS)
        picture = np.vstack([np.hstack(rows[i : i + COLUMNS]) for i in range(0, len(rows), COLUMNS)])
        write_png(GALLERY / f"methods-{name}.png", exposure * picture)
        write_curves(GALLERY / f"methods-{name}.svg", curves)


if __name__ == "__main__":
    main()
