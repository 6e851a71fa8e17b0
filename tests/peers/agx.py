"""`--view agx` and `--view neutral` beside the configuration of Blender, in bytes of PNG files.

    HALFLIGHT=target/release/halflight PYTHON tests/peers/agx.py [--colours 500]

PYTHON has `bpy`, whose configuration of OpenColorIO is read, and `opencolorio`, `OpenEXR` and `pillow` of PyPI. A plate
emits random colours over 13 stops and greys over 20; our program renders it, and both programs turn it into bytes.
"""

import argparse
import importlib.util
import os
import pathlib
import subprocess
import tempfile

import numpy as np
import OpenEXR
import PyOpenColorIO as ocio
from PIL import Image

ROOT = pathlib.Path(__file__).parents[2]
PROGRAM = os.environ.get("HALFLIGHT", str(ROOT / "target/release/halflight"))
COLUMNS, BLOCK = 25, 4


def configuration():
    """That of the package, which is found without the import of Blender."""
    package = pathlib.Path(importlib.util.find_spec("bpy").origin).parent
    return ocio.Config.CreateFromFile(str(next(package.glob("*/datafiles/colormanagement/config.ocio"))))


def plate(folder, colours):
    """A picture of squares of `colours` on a lamp that fills the view of a parallel camera."""
    rows = len(colours) // COLUMNS
    blocks = colours.reshape(rows, COLUMNS, 3).repeat(BLOCK, 0).repeat(BLOCK, 1).astype(np.float32)
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    OpenEXR.File(header, {"RGB": np.ascontiguousarray(blocks)}).write(str(folder / "colours.exr"))
    (folder / "plate.obj").write_text(
        f"v 0 0 0\nv {COLUMNS} 0 0\nv {COLUMNS} {rows} 0\nv 0 {rows} 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n"
        "usemtl plate\nf 1/1 2/2 3/3 4/4\n"
    )
    middle = f"{COLUMNS / 2}, {rows / 2}"
    (folder / "plate.toml").write_text(
        '[[mesh]]\nfile = "plate.obj"\n[material.plate]\ncolor = 0\nemission = 1\nemission_map = "colours.exr"\n'
        f'[camera]\nkind = "orthographic"\nheight = {rows}\neye = [{middle}, 1]\nlook_at = [{middle}, 0]\n'
    )
    return [COLUMNS * BLOCK, rows * BLOCK]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--colours", type=int, default=500)
    count = parser.parse_args().colours
    dice = np.random.default_rng(1)
    colours = 2.0 ** dice.uniform(-8, 5, (count, 1)) * dice.uniform(0, 1, (count, 3))
    greys = np.repeat(2.0 ** np.linspace(-12, 8, COLUMNS)[:, None], 3, axis=1)
    colours = np.concatenate([colours[: count // COLUMNS * COLUMNS], greys]).astype(np.float32)
    config = configuration()
    print("| view | colours | mean difference | within 1 | largest | greys, largest |\n|---|---|---|---|---|---|")
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        width, height = plate(folder, colours)
        for view, theirs in (("agx", "AgX"), ("neutral", "Khronos PBR Neutral")):
            png = folder / f"{view}.png"
            command = [PROGRAM, "render", folder / "plate.toml", "-o", png, "--view", view, "--method", "path"]
            command += ["--spp", 4, "--reconstruct", "off", "--size", f"{width}x{height}"]
            subprocess.run([*map(str, command)], check=True, capture_output=True)
            ours = np.array(Image.open(png).convert("RGB"))[BLOCK // 2 :: BLOCK, BLOCK // 2 :: BLOCK].reshape(-1, 3)
            transform = ocio.DisplayViewTransform("Linear Rec.709", "sRGB", theirs)
            processor = config.getProcessor(transform).getDefaultCPUProcessor()
            known = np.array([processor.applyRGB([float(x) for x in colour]) for colour in colours])
            # Bytes are rounded: half a step is no difference.
            off = np.maximum(np.abs(ours - 255 * np.clip(known, 0, 1)) - 0.5, 0).max(axis=1)
            off, of_greys = off[:-COLUMNS], off[-COLUMNS:]
            print(
                f"| {view} | {len(off)} | {off.mean():.3f} | {100 * (off <= 1).mean():.1f} % | {off.max():.2f} "
                f"| {of_greys.max():.2f} |"
            )


if __name__ == "__main__":
    main()
