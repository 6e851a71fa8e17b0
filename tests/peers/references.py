"""Our pictures of the published scenes against the references that came with them.

    python3 tests/peers/references.py [--spp 256] [--no-mitsuba] [scene ...]

The scenes live outside of this repository (`HALFLIGHT_SCENES`). Mean colours are compared at reduced size, ours
and theirs clipped at the 99.5th percentile of the reference, so that a few fireflies do not decide. Beside it
Mitsuba with the BSDFs of the source against the reference, and ours against Mitsuba with the materials that MTL
says: where the last is 1, what is left of the first is what MTL cannot say.
"""

import argparse
import tempfile
from pathlib import Path

import workbench
from mitsuba_scene import mitsuba_scene
from published import SCENES, published
from scene_file import write_scene
from workbench import mi, np, read_picture, write_picture

# Scene, file of the reference, what the picture is divided by in width and height.
CASES = {
    "cornell-box-bitterli": ("reference.exr", 8),
    "veach-mis": ("reference.exr", 8),
    "veach-bidir": ("reference.exr", 8),
    "veach-ajar": ("reference.exr", 8),
    "living-room": ("reference.exr", 8),
    "staircase": ("reference.exr", 8),
    "water-caustic": ("reference.exr", 8),
    "material-testball": ("reference.exr", 8),
    "glass-of-water": ("reference_full_scene.exr", 8),
}
CLIP_AT = 99.5
TOLERANCE = 0.02


def shrink(picture, by):
    """Means over squares; what does not fill one is left out."""
    height, width = (n // by * by for n in picture.shape[:2])
    return picture[:height, :width].reshape(height // by, by, width // by, by, 3).mean(axis=(1, 3))


def ratio(picture, reference):
    cap = np.percentile(reference, CLIP_AT)
    return np.minimum(picture, cap).mean() / np.minimum(reference, cap).mean()


def compare(name, arguments, program, folder):
    file, by = CASES[name]
    reference = read_picture(SCENES / name / file)
    reference[~np.isfinite(reference)] = 0.0
    reference = shrink(reference, by)
    description = published(name, (reference.shape[1], reference.shape[0]), limit_depth=True)
    toml = Path(folder) / f"{name}.toml"
    write_scene(toml, description)
    ours, _ = workbench.halflight(program, toml, arguments.spp, 1)
    pictures, off = [ours, reference], ratio(ours, reference)
    row = f"| {name} | {reference.shape[1]}x{reference.shape[0]} | {off:.3f} "
    if not arguments.no_mitsuba:
        source, mtl = (mitsuba_picture(description, folder, s, arguments.spp) for s in (True, False))
        pictures += [source, mtl]
        row += f"| {ratio(source, reference):.3f} | {ratio(ours, mtl):.3f} "
    print(row + f"| {'yes' if abs(off - 1) <= TOLERANCE else 'no'} |", flush=True)
    shown = np.hstack(pictures) / (3 * np.median(reference[reference > 0]))
    write_picture(workbench.OUTPUT / "published" / f"{name}.png", shown)


def mitsuba_picture(description, folder, source, spp):
    scene = mitsuba_scene(description, folder, source)
    return np.array(mi.render(scene, spp=spp, seed=1)).astype(np.float64)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="*", default=list(CASES))
    parser.add_argument("--spp", type=int, default=256)
    parser.add_argument("--no-mitsuba", action="store_true", help="ours only")
    arguments = parser.parse_args()
    program = workbench.halflight_program()
    print(f"{workbench.machine()}; {arguments.spp} spp; pictures in {workbench.OUTPUT / 'published'}")
    if arguments.no_mitsuba:
        print("| scene | size | ours / reference | within 2 % |\n|---|---|---|---|")
    else:
        print("| scene | size | ours / reference | Mitsuba / reference | ours / Mitsuba from MTL | within 2 % |")
        print("|---|---|---|---|---|---|")
    with tempfile.TemporaryDirectory() as folder:
        for name in arguments.scenes:
            compare(name, arguments, program, folder)


main()
