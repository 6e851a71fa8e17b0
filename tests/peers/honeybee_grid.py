"""Honeybee's recipe `point-in-time-grid`: halflight in the place of rtrace.

    pip install halflight-render[daylight] honeybee-radiance
    python3 tests/peers/honeybee_grid.py [--sensors 0.27] [--spp 16384] [--divisions 4096] [--folder target/peers/honeybee]

The commands of the recipe make an office of 5 m by 8 m with a glazed south wall, an overcast CIE sky, and a clear sky
with a sun of gendaylit. Two uncorrelated runs of rtrace without interpolation give its noise, halflight gives intervals:
the share of sensors whose difference is within the joint 95 % interval is printed, and the ratio of the means. A table
follows of errors against a long run of halflight, whose noise is subtracted, and of processor seconds, user and system:
rtrace with the parameters of the recipe and better ones, and halflight with one thread.
"""

import argparse
import json
import os
import resource
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pyradiance

# Half-width of a 95 % interval of halflight in standard errors.
QUANTILE = 2.262
UNBIASED = "-aa 0 -as 0 -ab 8 -lr 10 -lw 0 -dt 0 -dc 1 -dj 1 -ds 0.05 -u+"
SWEEP = ["-ab 2 -aa 0.1 -ad 2048 -ar 64", "-ab 6 -aa 0.1 -ad 2048 -ar 64"]
SWEEP += [f"{UNBIASED} -ad {divisions}" for divisions in (64, 256, 1024)]
SAMPLES = (16, 64, 256, 1024)
DAY = ["21", "Jun", "12:00", "--latitude", "47", "--longitude", "8", "--time-zone", "1"]
CLEAR = ["--direct-normal-irradiance", "800", "--diffuse_horizontal_irradiance", "120"]
SKIES = {"overcast": ["cie", *DAY, "--sky-type", "4"], "clear": ["climate-based", *DAY, *CLEAR]}


def run(*words, folder):
    """Runs a command in `folder`; returns its processor seconds."""
    tools = str(pyradiance.BINPATH)
    paths = {
        "PATH": os.pathsep.join([tools, str(Path(sys.executable).parent), os.environ["PATH"]]),
        "RAYPATH": f".:{tools}/../lib",
    }
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run([str(word) for word in words], cwd=folder, env=os.environ | paths, check=True, stdout=sys.stderr)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def model(folder, distance):
    """The office with its grid in a model folder."""
    from honeybee.model import Model
    from honeybee.room import Room
    from honeybee_radiance.sensorgrid import SensorGrid

    room = Room.from_box("office", 5.0, 8.0, 3.0)
    south = next(face for face in room.faces if face.normal.y < -0.5)
    south.apertures_by_ratio(0.4, 0.01)
    office = Model("office_model", [room])
    grid = SensorGrid.from_mesh3d("desk", room.generate_grid(distance, offset=0.8))
    office.properties.radiance.add_sensor_grids([grid])
    (folder / "model.hbjson").write_text(json.dumps(office.to_dict()))
    words = ["translate", "model-to-rad-folder", "model.hbjson", "--grid", " * ", "--grid-check", "--create-grids"]
    run("honeybee-radiance", *words, folder=folder)


def rtrace(folder, name, parameters):
    """Illuminances, and processor seconds of rtrace."""
    from halflight_render import daylight

    script = f"rtrace -I -h {parameters} {name}.oct < model/grid/desk.pts > {name}.txt"
    seconds = run("bash", "-c", script, folder=folder)
    return np.loadtxt(folder / f"{name}.txt") @ daylight.HONEYBEE * 179, seconds


def by_recipe(folder, name):
    """Processor seconds of the command of the recipe with its parameters."""
    point = ["raytrace", "point-in-time", f"{name}.oct", "model/grid/desk.pts", "--rad-params", SWEEP[0]]
    point += ["--rad-params-locked", "-h", "--metric", "illuminance"]
    return run("honeybee-radiance", *point, "--output", f"{name}-rtrace.res", folder=folder)


def ours(folder, name, spp):
    """Illuminances and half-widths, processor seconds of the command with one thread, and those of sampling."""
    from halflight_render import daylight

    output = f"{name}-halflight.res"
    words = ["-m", "halflight_render.daylight", f"{name}.oct", "model/grid/desk.pts"]
    whole = run(sys.executable, *words, "--output", output, "--spp", spp, "--threads", 1, folder=folder)
    start = time.process_time()
    octree, grid = folder / f"{name}.oct", folder / "model/grid/desk.pts"
    room = daylight.of_octree(octree)
    points = daylight.read_points(grid)
    start = time.process_time()
    found = room.irradiance(*points, spp=spp, threads=1)
    alone = time.process_time() - start
    values = found.rgb.astype(float) @ daylight.HONEYBEE * 179
    half = (found.upper - found.value) / np.maximum(found.value, 1e-9) * values
    assert np.allclose(values, np.loadtxt(folder / output), rtol=1e-5)
    return values, half, whole, alone


def compare(folder, name, arguments):
    run("honeybee-radiance", "sky", *SKIES[name], "--name", f"{name}.sky", folder=folder)
    octree = ["octree", "from-folder-static", "model", "--output", f"{name}.oct", "--add-before", f"{name}.sky"]
    run("honeybee-radiance", *octree, folder=folder)
    truth, half, _, seconds = ours(folder, name, arguments.spp)
    noise = (half / QUANTILE) ** 2
    runs = [rtrace(folder, name, f"{UNBIASED} -ad {arguments.divisions}") for _ in range(2)]
    theirs = (runs[0][0] + runs[1][0]) / 2
    own = np.mean((runs[0][0] - runs[1][0]) ** 2 / truth**2) / 4 * truth**2
    within = np.abs(theirs - truth) <= QUANTILE * np.sqrt(noise + own)
    print(f"\n{name}: {len(truth)} sensors, within the joint interval {within.mean():.3f}, ", end="")
    print(f"mean of rtrace over ours {theirs.mean() / truth.mean():.4f}, ", end="")
    print(f"processor s: ours {seconds:.1f}, rtrace {runs[0][1]:.1f} a run\n")
    print("| who | settings | rms error | mean | processor s, command | alone |\n|---|---|---|---|---|---|")
    rows = [("rtrace", text, *rtrace(folder, name, text)) for text in SWEEP]
    rows = [(*row[:3], by_recipe(folder, name) if at == 0 else np.nan, row[3]) for at, row in enumerate(rows)]
    for spp in SAMPLES:
        values, _, whole, alone = ours(folder, name, spp)
        rows.append(("halflight", f"--spp {spp}", values, whole, alone))
    for who, settings, values, whole, alone in rows:
        square = np.mean(((values - truth) ** 2 - noise) / truth**2)
        error, mean = max(square, 0) ** 0.5, values.mean() / truth.mean()
        print(f"| {who} | `{settings}` | {error:.2%} | {mean:.4f} | {whole:.2f} | {alone:.2f} |", flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--sensors", type=float, default=0.27, help="distance of sensors in m")
    parser.add_argument("--spp", type=int, default=16384)
    parser.add_argument("--divisions", type=int, default=4096)
    parser.add_argument("--folder", type=Path, default=Path("target/peers/honeybee"))
    arguments = parser.parse_args()
    folder = arguments.folder.absolute()
    folder.mkdir(parents=True, exist_ok=True)
    model(folder, arguments.sensors)
    for name in SKIES:
        compare(folder, name, arguments)


if __name__ == "__main__":
    main()
