"""The same samples raw, reconstructed by the program, and denoised by Open Image Denoise, beside a long reference.

    HALFLIGHT=program python3 tests/peers/denoising.py [scene ...] [--spp 16 64] [--reference-spp 1024]

Denoised pictures have albedo and normals without noise: those of the surfaces in the film file. Prints relMSE and
the told error, and writes docs/gallery/denoising-SCENE.png: raw, reconstructed, denoised, reference. Scenes are
those of the repository, and of the folder HALFLIGHT_SCENES. Needs numpy and pyoidn.
"""

import argparse
import json
import os
import subprocess
import tempfile
from pathlib import Path

import numpy as np
import pyoidn

from gallery import GALLERY, PROGRAM, ROOT, write_png
from measure import relmse
from smallvcm import read_pfm

KEPT = ROOT / "tests" / "output" / "denoising"
TILE, PIXEL, SURFACES = 16, 96, 60
OWN = {"cornell": "cornell.obj", "two-rooms": "two-rooms.toml", "glossy": "glossy.toml"}


def flags(name):
    """Scene and camera for the command line."""
    if name in OWN:
        return [str(ROOT / "scenes" / name / OWN[name])]
    folder = Path(os.environ["HALFLIGHT_SCENES"]) / name
    words = [line.split() for line in (folder / f"{name}.txt").read_text().splitlines()]
    of = lambda key: next(line[line.index(key) + 1:] for line in words if key in line[:2])
    vector = lambda key: ",".join(of(key)[:3])
    fov = min(float(of("fov")[0]), float(next(line for line in words if line[:2] == ["vertical", "fov"])[6]))
    camera = [f"--eye={vector('origin')}", f"--look-at={vector('target')}", f"--up={vector('up')}", f"--fov={fov}"]
    return [str(folder / f"{name}.obj"), *camera]


def render(scene, side, spp, seed, *more):
    with tempfile.TemporaryDirectory() as folder:
        picture, film = Path(folder) / "picture.pfm", Path(folder) / "film"
        command = [PROGRAM, "render", *scene, "--method", "path", "--size", f"{side}x{side}", "--spp", str(spp),
                   "--seed", str(seed), "--json", "-o", str(picture), "--checkpoint", str(film), *more]
        done = subprocess.run(command, capture_output=True, text=True)
        if done.returncode not in (0, 3):
            raise RuntimeError(f"{command}: {done.stderr}")
        return read_pfm(picture), json.loads(done.stdout), film.read_bytes()


def surfaces(film, side):
    """Albedo and normals of a film file (docs/file-container.md)."""
    length = int.from_bytes(film[12:16], "little")
    across = -(-side // TILE)
    at = 16 + length + 56 + across * across * 36
    planes = np.zeros((side, side, 6), np.float32)
    for tile in range(across * across):
        x, y = TILE * (tile % across), TILE * (tile // across)
        width, height = min(TILE, side - x), min(TILE, side - y)
        at += TILE * TILE * PIXEL
        values = np.frombuffer(film, "<f4", width * height * SURFACES // 4, at).reshape(height, width, -1)
        planes[y:y + height, x:x + width] = values[..., 8:14]
        at += width * height * SURFACES
    return planes[..., :3], planes[..., 3:]


def denoise(picture, albedo, normal):
    out = np.zeros_like(picture)
    with pyoidn.Device() as device:
        device.commit()
        with pyoidn.Filter(device, pyoidn.OIDN_FILTER_TYPE_RT) as denoiser:
            images = {"color": picture, "albedo": albedo, "normal": normal, "output": out}
            images = {name: np.ascontiguousarray(image, np.float32) for name, image in images.items()}
            for name, image in images.items():
                denoiser.set_image(name, image, pyoidn.OIDN_FORMAT_FLOAT3)
            denoiser.set_bool("hdr", True)
            denoiser.set_bool("cleanAux", True)
            denoiser.commit()
            denoiser.execute()
        if error := device.get_error():
            raise RuntimeError(error)
    return images["output"]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="*", default=list(OWN))
    parser.add_argument("--spp", type=int, nargs="+", default=[16, 64])
    parser.add_argument("--side", type=int, default=256)
    parser.add_argument("--reference-spp", type=int, default=1024)
    arguments = parser.parse_args()
    KEPT.mkdir(parents=True, exist_ok=True)
    print("scene, samples: relMSE raw, reconstructed (told, interval), denoised; gain over denoised")
    gains = []
    for name in arguments.scenes:
        scene, kept = flags(name), KEPT / f"{name}-{arguments.side}.npy"
        if not kept.exists():
            right, _, _ = render(scene, arguments.side, arguments.reference_spp, 1000, "--reconstruct", "off")
            np.save(kept, right)
        right, rows = np.load(kept), []
        for spp in arguments.spp:
            raw, _, _ = render(scene, arguments.side, spp, 1, "--reconstruct", "off")
            own, facts, film = render(scene, arguments.side, spp, 1)
            denoised = denoise(raw, *surfaces(film, arguments.side))
            errors, told = [relmse(picture, right) for picture in (raw, own, denoised)], facts["error"]
            interval = " to ".join(f"{end:.1e}" for end in told["interval"])
            gains.append(errors[2] / errors[1])
            print(f"{name}, {spp}: {errors[0]:.2e}, {errors[1]:.2e} ({told['relmse']:.2e}, {interval}), "
                  f"{errors[2]:.2e}; {gains[-1]:.2f}", flush=True)
            rows.append(np.concatenate([raw, own, denoised, right], axis=1))
        exposure = 0.8 / np.quantile(right, 0.95)
        write_png(GALLERY / f"denoising-{name}.png", exposure * np.concatenate(rows, axis=0))
    print(f"geometric mean of the gain over denoised pictures: {np.exp(np.mean(np.log(gains))):.2f}")


if __name__ == "__main__":
    main()
