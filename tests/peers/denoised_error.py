"""The told error of denoised pictures beside the true one.

    pip install halflight-render[denoise]
    python3 tests/peers/denoised_error.py [scene ...] [--seeds 20] [--spp 16 64 256] [--size 96 72]

Each picture is denoised by Open Image Denoise from two renders of half of the samples, with albedo and normals. The
truth is the mean of (D - R)(D - S) over the squared reference, where R and S are long independent renders: their noise
has no part in the mean. Prints for each scene and budget the median of told over true, and the share of seeds for which
the told relMSE is within a factor of 1.3 of the truth: of all, and of those whose error is said to be known; then the
share of intervals that hold. References are kept in target/peers/denoised_error.
"""

import argparse
from pathlib import Path

import numpy as np

import halflight_render as hl
from halflight_render.denoising import denoise

ROOT = Path(__file__).resolve().parents[2]
KEPT = ROOT / "target" / "peers" / "denoised_error"
SCENES = {
    "cornell": "scenes/cornell/cornell.obj",
    "dark-wall": "scenes/cornell/dark-wall.obj",
    "rough": "scenes/cornell/rough.toml",
    "two-rooms": "scenes/two-rooms/two-rooms.toml",
    "glossy": "scenes/glossy/glossy.toml",
    "room": "scenes/lightmap/room.toml",
}
WITHIN = 1.3


def references(scene, name, size, spp):
    """Two independent long renders."""
    KEPT.mkdir(parents=True, exist_ok=True)
    file = KEPT / f"{name}-{size[0]}x{size[1]}-{spp}.npz"
    if not file.exists():
        settings = {"size": size, "spp": spp, "method": "path", "reconstruct": False}
        r, s = (scene.render(seed=seed, **settings).image for seed in (1_000_000, 1_000_001))
        np.savez(file, r=r, s=s)
    kept = np.load(file)
    return kept["r"].astype(float), kept["s"].astype(float)


def true(image, r, s):
    """relMSE against both references."""
    reference = (r + s) / 2
    return np.mean((image - r) * (image - s) / (reference**2 + 0.01 * reference.mean() ** 2))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="*", default=list(SCENES))
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--spp", type=int, nargs="+", default=[16, 64, 256], help="samples of both renders together")
    parser.add_argument("--size", type=int, nargs=2, default=(96, 72))
    parser.add_argument("--reference-spp", type=int, default=4096)
    arguments = parser.parse_args()
    size = tuple(arguments.size)
    print("| scene | spp | noisy | denoised | told / true | within 1.3 | known | known within 1.3 | intervals hold |")
    print("|---|---|---|---|---|---|---|---|---|")
    of_all = []
    for name in arguments.scenes:
        scene = hl.open(ROOT / SCENES[name])
        both = references(scene, name, size, arguments.reference_spp)
        for spp in arguments.spp:
            rows = []
            settings = {"size": size, "spp": spp // 2, "method": "path", "reconstruct": False}
            settings["layers"] = ["albedo", "normal", "halves"]
            for seed in range(arguments.seeds):
                found = denoise(*(scene.render(seed=2 * seed + which, **settings) for which in (0, 1)))
                truth, (lower, upper) = true(found.image, *both), found.interval
                rows.append((found.noisy_relmse, truth, found.relmse, found.known, lower <= truth <= upper))
            noisy, truth, told, known, holds = np.array(rows).T
            fits = np.abs(np.log(told / truth)) <= np.log(WITHIN)
            of_all += list(zip(fits, known > 0, holds, strict=True))
            print(
                f"| {name} | {spp} | {np.median(noisy):.1e} | {np.median(truth):.1e} | {np.median(told / truth):.2f} | "
                f"{fits.mean():.0%} | {known.mean():.0%} | {share(fits[known > 0])} | {holds.mean():.0%} |",
                flush=True,
            )
    fits, known, holds = np.array(of_all, bool).T
    print(f"\nall: within 1.3 {share(fits)}, known {share(known)}, known within 1.3 {share(fits[known])}, ", end="")
    print(f"intervals hold {share(holds)}")


def share(values):
    """Mean of truth values, if there are some."""
    return f"{np.mean(values):.0%}" if len(values) else "-"


if __name__ == "__main__":
    main()
