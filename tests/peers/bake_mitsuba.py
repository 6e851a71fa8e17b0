"""Irradiance of sensors: a vectorised integrator of Mitsuba 3 beside `halflight bake`.

    python3 tests/peers/bake_mitsuba.py [--sensors 500] [--spp 1024] [diffuse textured constant point spot directional]

A sample of a sensor takes one light sample and one cosine-weighted direction, whose radiance is that of Mitsuba's `path`
without the emission of the first hit: the estimator of `bake` without its weights. Sensors look up from random positions of
a plane across the room. The share of sensors whose difference is within the joint 95 % interval is printed, the ratio of
the means, and the product of the squared error by variance and processor seconds, ours over Mitsuba's.
"""

import argparse
import csv
import resource
import subprocess
import tomllib

import workbench
from mitsuba_scene import mitsuba_scene
from workbench import dr, mi, np

SCENES = workbench.HERE / "scenes"
FOLDER = workbench.OUTPUT / "bake"
# The half-width of a 95 % interval by a bake, in standard errors.
QUANTILE = 2.262


def sensors(scene, count):
    box = scene.bbox()
    low, high = np.array(box.min).ravel(), np.array(box.max).ravel()
    places = low + (high - low) * (0.04 + 0.92 * np.random.default_rng(1).random((count, 3)))
    places[:, 1] = low[1] + 0.4 * (high[1] - low[1])
    return places


def irradiance(scene, places, spp, seed):
    """Luminance of the irradiance of all sensors, and its variance."""
    count = len(places)
    integrator = mi.load_dict({"type": "path", "max_depth": -1})
    sampler = mi.load_dict({"type": "independent"})
    sampler.seed(seed, count * spp)
    of = dr.arange(mi.UInt32, count * spp) // spp
    place = mi.Point3f(*(dr.gather(mi.Float, mi.Float(places[:, axis]), of) for axis in range(3)))
    up = mi.Vector3f(0.0, 1.0, 0.0)
    sensor = dr.zeros(mi.SurfaceInteraction3f, count * spp)
    sensor.p, sensor.n = place, mi.Normal3f(up)
    to_lamp, weight = scene.sample_emitter_direction(sensor, sampler.next_2d(), True)
    direct = weight * dr.maximum(dr.dot(up, to_lamp.d), 0.0)
    ray = mi.Ray3f(place, mi.Frame3f(up).to_world(mi.warp.square_to_cosine_hemisphere(sampler.next_2d())))
    hit = scene.ray_intersect(ray)
    emitter = hit.emitter(scene)
    emission = dr.select(emitter != None, emitter.eval(hit), 0.0)  # noqa: E711  (an array)
    radiance = integrator.sample(scene, sampler, mi.RayDifferential3f(ray), None, True)[0]
    value = mi.luminance(direct + dr.pi * (radiance - emission))
    samples = np.array(value).astype(np.float64).reshape(count, spp)
    return samples.mean(axis=1), samples.var(axis=1, ddof=1) / spp


def bake(program, scene, points, spp):
    table = FOLDER / "bake.csv"
    command = [program, "bake", str(scene), "--points", str(points), "--spp", str(spp), "--threads", "1", "-o", str(table)]
    before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
    subprocess.run([*command, "--caustics", "off"], check=True, capture_output=True)
    seconds = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before
    with open(table) as file:
        rows = [(float(row["value"]), float(row["upper"]) - float(row["value"])) for row in csv.DictReader(file)]
    values, half_widths = np.array(rows).T
    return values, (half_widths / QUANTILE) ** 2, seconds


def compare(name, arguments, program):
    path = SCENES / f"{name}.toml"
    description = tomllib.loads(path.read_text())
    # The camera is of no matter.
    description["camera"] = {"eye": [0, 0, 1], "look_at": [0, 0, 0], "up": [0, 1, 0], "fov": 40}
    description.setdefault("render", {})["size"] = [8, 8]
    scene = mitsuba_scene(description, path.parent)
    places = sensors(scene, arguments.sensors)
    points = FOLDER / f"{name}.pts"
    np.savetxt(points, np.hstack([places, np.tile([0.0, 1.0, 0.0], (len(places), 1))]), fmt="%.9g")
    irradiance(scene, places, 4, 0)  # Kernels are compiled.
    used = lambda: resource.getrusage(resource.RUSAGE_SELF).ru_utime
    before = used()
    theirs, their_variance = irradiance(scene, places, arguments.spp, 1)
    their_seconds = used() - before
    ours, our_variance, seconds = bake(program, path, points, arguments.spp)
    lit = theirs > 1e-3 * theirs.mean()
    within = np.abs(ours - theirs) <= QUANTILE * np.sqrt(our_variance + their_variance) + 1e-5 * theirs
    work = lambda variance, seconds: np.mean(variance[lit] / theirs[lit] ** 2) * seconds
    ratio = work(our_variance, seconds) / work(their_variance, their_seconds)
    off = ours[lit].mean() / theirs[lit].mean() - 1
    error = np.sqrt((our_variance + their_variance)[lit].sum()) / theirs[lit].sum()
    print(
        f"| {name} | {lit.sum()} | {within[lit].mean():.3f} | {100 * off:+.2f} ± {200 * error:.2f} % "
        f"| {seconds:.2f} | {their_seconds:.2f} | {ratio:.2f} |",
        flush=True,
    )


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scenes", nargs="*", default=["diffuse", "textured", "constant", "point", "spot", "directional"])
    parser.add_argument("--sensors", type=int, default=500)
    parser.add_argument("--spp", type=int, default=1024)
    arguments = parser.parse_args()
    FOLDER.mkdir(parents=True, exist_ok=True)
    dr.set_thread_count(1)
    print("| scene | sensors | within | mean, ours over theirs | ours s | theirs s | variance × s, ours over theirs |")
    print("|---|---|---|---|---|---|---|", flush=True)
    for name in arguments.scenes:
        compare(name, arguments, workbench.halflight_program())


if __name__ == "__main__":
    main()
