"""Irradiance of sensors: Radiance's `rtrace -I` beside `halflight bake`.

    python3 tests/peers/bake_radiance.py [--sensors 500] [--divisions 4096] [cornell two-rooms]

Scenes and their translation are those of `radiance.py`. Sensors look up from random positions of a plane across the
room. First the values: two uncorrelated runs of `rtrace` without interpolation give its noise, a bake gives intervals;
the share of sensors whose difference is within the joint 95 % interval is printed, and the ratio of the means. Then the
processor time of one thread for an error: a sweep of `rtrace` with its ambient cache and without, and of samples of
`bake --method path`, against a long bake, whose noise is subtracted.
"""

import argparse
import csv

import radiance
import workbench
from workbench import np

# -aa, -ad, -as, -ar. Without interpolation the other two are of no use.
SWEEP = [(0, 64, 0, 0), (0, 256, 0, 0), (0, 1024, 0, 0), (0.5, 256, 64, 32), (0.3, 512, 128, 64), (0.2, 512, 128, 64)]
SAMPLES = (16, 64, 256, 1024)
LIMITS = ["-ab", 12, "-lr", 12, "-lw", 0, "-dj", 1, "-ds", 0.05, "-dt", 0, "-dc", 1, "-u+"]
# The half-width of a 95 % interval by a bake, in standard errors.
QUANTILE = 2.262
REFERENCE_SPP = 16384


def sensors(name, count):
    """Random positions 0.4 of the height above the lowest point, away from the walls, that look up."""
    lines = (radiance.FOLDER / f"{name}.obj").read_text().splitlines()
    corners = np.array([line.split()[1:] for line in lines if line.startswith("v ")], float)
    low, high = corners.min(axis=0), corners.max(axis=0)
    places = low + (high - low) * (0.04 + 0.92 * np.random.default_rng(1).random((count, 3)))
    places[:, 1] = low[1] + 0.4 * (high[1] - low[1])
    points = radiance.FOLDER / f"{name}.pts"
    np.savetxt(points, np.hstack([places, np.tile([0.0, 1.0, 0.0], (count, 1))]), fmt="%.9g")
    return points


def rtrace(folder, name, points, accuracy, divisions, supersamples, resolution):
    """Luminance of the irradiance of all sensors, and processor seconds."""
    quality = ["-aa", accuracy, "-ad", divisions, "-as", supersamples, "-ar", resolution]
    script = 'exec "$0" -h -I+ "${@:3}" "$1" < "$2"'
    octree = radiance.FOLDER / f"{name}.oct"
    command = ["bash", "-c", script, folder / "rtrace", octree, points, *quality, *LIMITS]
    output, seconds = radiance.timed(command)
    values = np.array([line.split() for line in output.decode().splitlines() if line.strip()], float)
    return values @ [0.2126, 0.7152, 0.0722], seconds


def bake(program, name, points, spp, seed):
    """Luminance, half-widths of the intervals, and processor seconds."""
    table = radiance.FOLDER / f"{name}-bake.csv"
    scene = radiance.FOLDER / f"{name}.obj"
    command = [program, "bake", scene, "--points", points, "--spp", spp, "--seed", seed, "--threads", 1, "-o", table]
    _, seconds = radiance.timed(command)
    with open(table) as file:
        rows = [(float(row["value"]), float(row["upper"]) - float(row["value"])) for row in csv.DictReader(file)]
    values, half_widths = np.array(rows).T
    return values, half_widths, seconds


def compare(name, arguments, program, folder):
    scene = radiance.SCENES[name]
    radiance.write_scene(name, workbench.ROOT / scene["obj"], scene.get("sphere", False))
    with open(radiance.FOLDER / f"{name}.oct", "wb") as octree:
        radiance.subprocess.check_call([folder / "oconv", "-w", radiance.FOLDER / f"{name}.rad"], stdout=octree)
    points = sensors(name, arguments.sensors)
    truth, half_widths, seconds = bake(program, name, points, arguments.reference_spp, 1000)
    noise = (half_widths / QUANTILE) ** 2
    lit = truth > 1e-3 * truth.mean()
    runs = [rtrace(folder, name, points, 0, arguments.divisions, 0, 0) for _ in range(2)]
    theirs = np.mean([values for values, _ in runs], axis=0)
    own = np.mean((runs[0][0] - runs[1][0])[lit] ** 2 / truth[lit] ** 2) / 4 * truth**2
    within = np.abs(theirs - truth) <= QUANTILE * np.sqrt(noise + own)
    print(f"\n{name}: {lit.sum()} lit sensors, within the joint interval {within[lit].mean():.3f}, ", end="")
    print(f"mean of rtrace over ours {theirs[lit].mean() / truth[lit].mean():.4f}, ", end="")
    print(f"processor s: ours {seconds:.1f}, rtrace {runs[0][1]:.1f} a run\n")
    print("| who | settings | rms error | mean | processor s |\n|---|---|---|---|---|", flush=True)

    def note(who, settings, values, seconds):
        square = np.mean(((values - truth)[lit] ** 2 - noise[lit]) / (truth[lit] ** 2 + 0.01 * truth[lit].mean() ** 2))
        error, mean = np.sqrt(max(square, 0.0)), values[lit].mean() / truth[lit].mean()
        print(f"| {who} | {settings} | {error:.4f} | {mean:.4f} | {seconds:.2f} |", flush=True)

    for settings in SWEEP[: arguments.sweep]:
        note("rtrace", "-aa {} -ad {} -as {} -ar {}".format(*settings), *rtrace(folder, name, points, *settings))
    for spp in SAMPLES:
        values, _, seconds = bake(program, name, points, spp, 1)
        note("bake", f"{spp} samples", values, seconds)


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scenes", nargs="*", default=["cornell", "two-rooms"])
    parser.add_argument("--sensors", type=int, default=500)
    parser.add_argument("--divisions", type=int, default=4096, help="rays of a sensor of rtrace")
    parser.add_argument("--sweep", type=int, default=len(SWEEP), help="only so many settings of rtrace")
    parser.add_argument("--reference-spp", type=int, default=REFERENCE_SPP)
    arguments = parser.parse_args()
    program, folder = workbench.halflight_program(), radiance.programs()
    for name in arguments.scenes:
        compare(name, arguments, program, folder)


if __name__ == "__main__":
    main()
