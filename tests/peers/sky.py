"""The sky beside Mitsuba 3 and the solar position algorithm of NREL.

    python3 tests/peers/sky.py [--positions 500]

Prints three tables: the largest differences of the position of the sun to `pvlib` at random times and places of
1980 to 2050; those of a panorama of our sky to the model of Mitsuba's `sunsky` at the directions of its pixels; and the
irradiance of our sun (Preetham et al. 1999) over that of Mitsuba's (Hosek and Wilkie 2013). Needs `pip install
pvlib` in the environment of the peers, and `HALFLIGHT` or a release build.
"""

import argparse
import json
import math
import os
import pathlib
import random
import subprocess
import tempfile

import mitsuba as mi
import numpy as np

mi.set_variant("scalar_rgb")

# Units of the RGB model of Mitsuba in ours: its CIE_Y normalization, and 683 lm/W over 179 lm/W.
UNITS = 106.856895 * 683 / 179
APERTURE = math.radians(0.5358 / 2)
ROOT = pathlib.Path(__file__).parents[2]
PROGRAM = os.environ.get("HALFLIGHT", str(ROOT / "target/release/halflight"))


def run(*arguments):
    return subprocess.run([PROGRAM, *map(str, arguments)], check=True, capture_output=True, text=True).stdout


def positions(folder, count):
    import pandas
    import pvlib

    dice, worst, found = random.Random(1), [0.0, 0.0], 0
    while found < count:
        day = pandas.Timestamp("1980-01-01", tz="UTC") + pandas.Timedelta(seconds=dice.randrange(70 * 31556952))
        latitude, longitude = dice.uniform(-89, 89), dice.uniform(-180, 180)
        times = pandas.DatetimeIndex([day])
        theirs = pvlib.solarposition.spa_python(times, latitude, longitude, 0, 101000, 10, None).iloc[0]
        if theirs["apparent_elevation"] < 0.5:
            continue
        found += 1
        scene = folder / "sun.toml"
        scene.write_text(
            f'[sky]\ndate = "{day:%Y-%m-%d}"\ntime = "{day:%H:%M:%S}Z"\n'
            f"latitude = {latitude}\nlongitude = {longitude}\n"
        )
        ours = json.loads(run("info", scene, "--json"))["sun"]
        elevation = ours["elevation"] - theirs["apparent_elevation"]
        azimuth = (ours["azimuth"] - theirs["azimuth"] + 180) % 360 - 180
        azimuth *= math.cos(math.radians(ours["elevation"]))
        worst = [max(worst[0], abs(elevation)), max(worst[1], abs(azimuth))]
    print("| positions | largest difference of elevation | of azimuth, along the circle |\n|---|---|---|")
    print(f"| {count} | {worst[0]:.4f}° | {worst[1]:.4f}° |\n")


def emitter(elevation, turbidity, albedo, **scales):
    r = math.radians(elevation)
    sun = {"type": "sunsky", "turbidity": float(turbidity), "albedo": albedo, **scales}
    sun["sun_direction"] = [0, math.cos(r), math.sin(r)]
    return mi.load_dict({"type": "scene", "sky": sun}).environment()


def radiance(sky, directions):
    si, values = mi.SurfaceInteraction3f(), []
    for direction in directions:
        si.wi = mi.Vector3f(*(-float(x) for x in direction))
        values.append(np.array(sky.eval(si)))
    return np.array(values) * UNITS


def skies(folder):
    size = 64
    print("| sun | turbidity | albedo | mean over Mitsuba's | root mean square difference | largest |")
    print("|---|---|---|---|---|---|")
    for elevation, turbidity, albedo in ((60, 3, 0.2), (30, 2, 0.0), (10, 6, 0.5), (85, 9, 0.3), (3, 2.5, 0.2)):
        r = math.radians(elevation)
        scene = folder / "sky.toml"
        # Mitsuba has z up and the sun towards y, which is our −z.
        scene.write_text(
            f"[sky]\nsun = [0, {math.sin(r)}, {-math.cos(r)}]\nturbidity = {turbidity}\nground_albedo = {albedo}\n"
            'sun_intensity = 0\n[camera]\nkind = "panorama"\neye = [0, 0, 0]\nlook_at = [0, 0, -1]\n'
        )
        run("render", scene, "--size", f"{2 * size}x{size}", "--spp", 64, "--method", "path", "-o", folder / "sky.pfm")
        picture = np.array(mi.Bitmap(str(folder / "sky.pfm")).convert(mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.Float32))
        sky, rows, sub = emitter(elevation, turbidity, albedo, sun_scale=0.0), size // 2 - 1, 4
        ours, theirs = [], []
        for y in range(rows):
            for x in range(0, 2 * size, 3):
                parts = []
                for i in range(sub * sub):
                    theta = math.pi * (y + (i // sub + 0.5) / sub) / size
                    phi = math.pi * (x + (i % sub + 0.5) / sub) / size - math.pi
                    parts.append((math.sin(theta) * math.sin(phi), math.sin(theta) * math.cos(phi), math.cos(theta)))
                theirs.append(radiance(sky, parts).mean(axis=0))
                ours.append(picture[y, x])
        ours, theirs = np.array(ours), np.array(theirs)
        off = ours / theirs - 1
        print(
            f"| {elevation}° | {turbidity} | {albedo} | {ours.mean() / theirs.mean():.4f} "
            f"| {100 * np.sqrt((off**2).mean()):.2f} % | {100 * np.abs(off).max():.1f} % |"
        )
    print()


def suns(folder):
    print("| turbidity | sun | ours, W/m² | Mitsuba's | luminance over Mitsuba's |\n|---|---|---|---|---|")
    weights = np.array([0.2126, 0.7152, 0.0722])
    for turbidity in (2, 3, 6):
        for elevation in (10, 30, 60, 85):
            r = math.radians(elevation)
            up = np.array([0, math.cos(r), math.sin(r)])
            across = np.cross(up, [1.0, 0, 0])
            disc = []
            for k in range(400):
                radius, angle = math.sqrt((k + 0.5) / 400) * math.sin(APERTURE) * 0.9999, 2.399963 * k
                disc.append(up * math.sqrt(1 - radius**2) + radius * (
                    math.cos(angle) * np.array([1.0, 0, 0]) + math.sin(angle) * across))
            sky = emitter(elevation, turbidity, 0.2, sky_scale=0.0)
            theirs = radiance(sky, disc).mean(axis=0) * math.pi * math.sin(APERTURE) ** 2
            scene, points = folder / "sun.toml", folder / "point.pts"
            direction = f"0 {math.sin(r)} {-math.cos(r)}"
            points.write_text(f"0 0 0 {direction}\n")
            values = []
            for intensity in (0, 1):
                scene.write_text(
                    f"[sky]\nsun = [{direction.replace(' ', ', ')}]\nturbidity = {turbidity}\nground_albedo = 0\n"
                    f"sun_intensity = {intensity}\n"
                )
                table = run("bake", scene, "--points", points, "--spp", 4096, "--light", "direct")
                values.append(np.array([float(x) for x in table.splitlines()[1].split(",")[6:9]]))
            ours = values[1] - values[0]
            text = [" ".join(f"{x:.0f}" for x in value) for value in (ours, theirs)]
            print(f"| {turbidity} | {elevation}° | {text[0]} | {text[1]} | {(ours @ weights) / (theirs @ weights):.3f} |")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--positions", type=int, default=500)
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        skies(folder)
        suns(folder)
        positions(folder, arguments.positions)


if __name__ == "__main__":
    main()
