"""A lightmap and ambient cubes in Bevy, beside our own picture.

    cargo build --manifest-path scenes/lightmap/bevy/Cargo.toml --target-dir /tmp/bevy
    python3 tests/peers/lightmap_bevy.py /tmp/bevy/debug/lightmap-room [--program target/release/halflight]

Needs a Vulkan device, which mesa-vulkan-drivers is in software. Bakes the maps of `scenes/lightmap/bevy`, lets Bevy
write pictures in linear values, and prints the FLIP of the room against our own picture, and the errors of the
sphere, relative to its largest value: against the ambient cubes of the file, interpolated as Bevy documents it, and
against irradiances by its normals.
"""

import argparse
import json
import os
import pathlib
import subprocess
import tempfile

import numpy as np

SCENES = pathlib.Path(__file__).resolve().parents[2] / "scenes" / "lightmap"
SIDE = 300
PROBES = 6
EYE, TARGET = np.array([0, 1, 3.6]), np.array([0, 0.95, 0])
CENTRE, RADIUS, REFLECTANCE = np.array([0.5, 0.45, 0.25]), 0.3, 0.7
LOW, SIDES = np.array([-1.0, 0.0, -1.0]), 2.0


def picture(path):
    """Rows from the top of a PFM file."""
    with open(path, "rb") as file:
        assert file.readline() == b"PF\n"
        width, height = map(int, file.readline().split())
        file.readline()
        return np.frombuffer(file.read(), "<f4").reshape(height, width, 3)[::-1]


def sphere_pixels():
    """Rows, columns, positions and normals of every seventh pixel inside the outline of the sphere."""
    along = (TARGET - EYE) / np.linalg.norm(TARGET - EYE)
    across = np.cross(along, [0, 1, 0])
    across /= np.linalg.norm(across)
    up, slope = np.cross(across, along), np.tan(np.radians(20))
    row, column = (axis.ravel() for axis in np.mgrid[0:SIDE, 0:SIDE])
    x, y = ((2 * axis + 1) / SIDE - 1 for axis in (column, row))
    rays = along + slope * (x[:, None] * across - y[:, None] * up)
    rays /= np.linalg.norm(rays, axis=1)[:, None]
    nearest = rays @ (CENTRE - EYE)
    square = RADIUS**2 - ((EYE + nearest[:, None] * rays - CENTRE) ** 2).sum(axis=1)
    # Pixels at the outline have other light in them.
    inside = np.flatnonzero(square > 0.2 * RADIUS**2)[::7]
    position = EYE + (nearest[inside] - np.sqrt(square[inside]))[:, None] * rays[inside]
    return row[inside], column[inside], position, (position - CENTRE) / RADIUS


def by_cubes(path, position, normal):
    """Irradiance / pi by the texture of an irradiance volume: sides x, y, z along its depth, negative ones below."""
    texels = np.frombuffer(path.read_bytes(), "<f2", offset=200).astype(float)
    texels = texels.reshape(3, PROBES, 2, PROBES, PROBES, 4)[..., :3]
    place = np.clip((position - LOW) / SIDES * PROBES - 0.5, 0, PROBES - 1)
    low = np.minimum(np.floor(place).astype(int), PROBES - 2)
    part, sum_ = place - low, 0
    for axis in range(3):
        sign = (normal[:, axis] < 0).astype(int)
        for corner in np.ndindex(2, 2, 2):
            weight = np.prod([part[:, i] if corner[i] else 1 - part[:, i] for i in range(3)], axis=0)
            x, y, z = (low + corner).T
            sum_ = sum_ + (normal[:, axis] ** 2 * weight)[:, None] * texels[axis, z, sign, y, x]
    return sum_


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("bevy", type=pathlib.Path)
    parser.add_argument("--program", default="target/release/halflight")
    parser.add_argument("--spp", type=int, default=128)
    parser.add_argument("--keep", type=pathlib.Path, help="folder of the pictures")
    given = parser.parse_args()
    folder = given.keep or pathlib.Path(tempfile.mkdtemp())
    assets = folder / "assets"
    assets.mkdir(parents=True, exist_ok=True)
    room = str(SCENES / "room.toml")

    def halflight(*arguments):
        run = subprocess.run([given.program, *map(str, arguments)], check=True, stdout=subprocess.PIPE)
        return run.stdout.decode()

    maps = (["--lightmap", "all", "--size", "256x192", "--unit", "white", "-o", assets / "map.exr"],
            ["--probes", f"{PROBES}x{PROBES}x{PROBES}", "--box=-1,0,-1,1,2,1", "-o", assets / "probes.ktx2"])
    for arguments in maps:
        halflight("bake", room, *arguments, "--spp", given.spp)
    halflight("render", room, "--size", f"{SIDE}x{SIDE}", "--spp", given.spp, "--method", "path", "-o", folder / "own.pfm")
    environment = {**os.environ, "BEVY_ASSET_ROOT": str(folder)}
    for name in ("room", "sphere"):
        subprocess.run([given.bevy.resolve(), folder / f"{name}.pfm", name], check=True, env=environment)
    row, column, position, normal = sphere_pixels()
    # A sphere of triangles without thickness in the light: probes do not see it.
    points = "".join("{} {} {} {} {} {}\n".format(*CENTRE, *n) for n in normal)
    (folder / "sphere.pts").write_text(points)
    halflight("bake", room, "--points", folder / "sphere.pts", "--unit", "white", "--spp", 2048, "-o", folder / "sphere.res")
    shown = picture(folder / "sphere.pfm")[row, column] / REFLECTANCE
    truths = {
        "ambient cubes": by_cubes(assets / "probes.ktx2", position, normal),
        "irradiances": np.loadtxt(folder / "sphere.res"),
    }
    compared = json.loads(halflight("compare", folder / "room.pfm", folder / "own.pfm", "--json"))
    print(f"room: FLIP {compared['flip']:.4f}")
    for name, truth in truths.items():
        error = np.sqrt(((shown - truth) ** 2).mean()) / truth.max()
        print(f"sphere against {name}: {error:.4f}, mean {shown.mean() / truth.mean():.4f} at {len(row)} pixels")


if __name__ == "__main__":
    main()
