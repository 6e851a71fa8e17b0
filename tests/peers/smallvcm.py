"""SmallVCM's four scenes: 1 / (relMSE x seconds) of its own program's algorithms and of our methods.

    SMALLVCM=.../smallvcm python3 tests/peers/smallvcm.py [scene ...] [--seconds 20] [--seeds 3] [--reference-seconds 300]

`SMALLVCM` names its program, with one line of src/config.hxx changed: `mBaseSeed` is the environment's `SEED`.
The geometry, lights, camera and limit of depth (10 segments) are SmallVCM's; spheres are meshes with smooth
normals, and its Phong floor is our GGX coat with the same exponent. Each program is measured against its own
reference, the mean of long pictures of its bidirectional method and of our `path` with photons. Both run on
one thread, and seconds are those of the processor: SmallVCM's `-t` counts them already.
"""

import argparse
import json
import math
import os
import resource
import statistics
import subprocess
import tempfile
from pathlib import Path

import numpy as np

from scene_file import write_scene

SIZE = 512
DEPTH = 10
SCENES = {"sun": 0, "ceiling": 1, "point": 2, "background": 3}
THEIRS = ("pt", "lt", "ppm", "bpm", "bpt", "vcm")
OURS = ("auto", "path", "sppm", "light", "bdpt", "vcm", "mlt")
PROGRAM = os.environ.get("HALFLIGHT", "target/release/halflight")

BOX_MIN, BOX_MAX = (-1.27029, -1.25549, -1.28002), (1.28975, 1.30455, 1.28002)
MATERIALS = {
    "floor": "Kd 0.1 0.1 0.1\nKs 0.7 0.7 0.7\nNs 90\nillum 2",
    "green": "Kd 0.156863 0.803922 0.172549",
    "red": "Kd 0.803922 0.152941 0.152941",
    "white": "Kd 0.803922 0.803922 0.803922",
    "blue": "Kd 0.156863 0.172549 0.803922",
    "mirror": "Kd 0 0 0\nKs 1 1 1\nillum 3",
    "glass": "Kd 0 0 0\nTf 1 1 1\nNi 1.6\nillum 7",
    "lamp": "Kd 0 0 0\nKe 25.0333 25.0333 25.0333",
}


def corners(low, high):
    """The eight corners of a box in SmallVCM's order."""
    (x0, y0, z0), (x1, y1, z1) = low, high
    return [(x0, y1, z0), (x1, y1, z0), (x1, y1, z1), (x0, y1, z1),
            (x0, y0, z0), (x1, y0, z0), (x1, y0, z1), (x0, y0, z1)]


class Obj:
    """Lines of an OBJ file in the making."""

    def __init__(self):
        self.lines, self.vertices, self.normals = ["mtllib box.mtl"], 0, 0

    def quads(self, points, faces):
        """Quadrilaterals of `points`, each with its material."""
        self.lines += [f"v {x} {y} {z}" for x, y, z in points]
        for material, face in faces:
            self.lines += [f"usemtl {material}", "f " + " ".join(str(self.vertices + 1 + i) for i in face)]
        self.vertices += len(points)

    def sphere(self, center, radius, material, rows=128):
        """A sphere of `rows` times twice as many quadrilaterals with smooth normals."""
        columns = 2 * rows
        for i in range(rows + 1):
            for j in range(columns):
                theta, phi = math.pi * i / rows, 2 * math.pi * j / columns
                n = (math.sin(theta) * math.cos(phi), math.sin(theta) * math.sin(phi), math.cos(theta))
                self.lines.append("v " + " ".join(repr(c + radius * x) for c, x in zip(center, n)))
                self.lines.append("vn " + " ".join(map(repr, n)))
        self.lines.append(f"usemtl {material}")
        for i in range(rows):
            for j in range(columns):
                ring = [(i, j), (i + 1, j), (i + 1, (j + 1) % columns), (i, (j + 1) % columns)]
                ids = [a * columns + b + 1 for a, b in ring]
                self.lines.append("f " + " ".join(f"{self.vertices + k}//{self.normals + k}" for k in ids))
        self.vertices += (rows + 1) * columns
        self.normals += (rows + 1) * columns


def scene(name, folder):
    """One of the four scenes as files in `folder`; the path of its description."""
    obj = Obj()
    box = corners(BOX_MIN, BOX_MAX)
    obj.quads(box, [("floor", (0, 4, 5, 1)), ("blue", (0, 1, 2, 3)), ("white", (2, 6, 7, 3)),
                    ("green", (3, 7, 4, 0)), ("red", (1, 5, 6, 2))])
    if name != "point":
        obj.quads(corners((-0.25, -0.25, 1.26002), (0.25, 0.25, 1.28002)), [
            ("white", (0, 3, 2, 1)), ("white", (3, 0, 4, 7)), ("white", (1, 2, 6, 5)), ("white", (4, 5, 6, 7)),
            ("lamp" if name == "ceiling" else "white", (0, 1, 5, 4))])
    if name == "ceiling":
        middle = [(BOX_MIN[i] + BOX_MAX[i]) / 2 for i in (0, 1)]
        obj.sphere((*middle, BOX_MIN[2] + 0.8), 0.8, "mirror")
    else:
        width = BOX_MAX[0] - BOX_MIN[0]
        y, z = (BOX_MIN[1] + BOX_MAX[1]) / 2, BOX_MIN[2] + 0.5
        obj.sphere((BOX_MIN[0] + 2 * width / 7, y, z), 0.5, "mirror")
        obj.sphere((BOX_MAX[0] - 2 * width / 7, y, z), 0.5, "glass")
    (folder / "box.obj").write_text("\n".join(obj.lines) + "\n")
    (folder / "box.mtl").write_text("".join(f"newmtl {name}\n{text}\n" for name, text in MATERIALS.items()))

    eye, forward = (-0.0439815, -4.12529, 0.222539), (0.00688625, 0.998505, -0.0542161)
    description = {
        "render": {"size": [SIZE, SIZE], "max_depth": DEPTH},
        "mesh": [{"file": str(folder / "box.obj")}],
        "camera": {"eye": list(eye), "look_at": [a + b for a, b in zip(eye, forward)],
                   "up": [3.73896e-4, 0.0542148, 0.998529], "fov": 45.0},
    }
    if name == "sun":
        description["light"] = [{"kind": "directional", "direction": [-1, 1.5, -1], "irradiance": [10, 4, 0]}]
    if name == "point":
        description["light"] = [{"kind": "point", "position": [0, -0.5, 1], "intensity": 70 / (4 * math.pi)}]
    if name == "background":
        description["environment"] = {"radiance": [135 / 255, 206 / 255, 250 / 255]}
    write_scene(folder / "box.toml", description)
    return folder / "box.toml"


def read_pfm(path):
    with open(path, "rb") as file:
        assert file.readline().strip() == b"PF"
        width, height = map(int, file.readline().split())
        file.readline()
        return np.frombuffer(file.read(), "<f4").reshape(height, width, 3)[::-1].astype(np.float64)


def read_hdr(path):
    """SmallVCM's picture: flat RGBE."""
    data = Path(path).read_bytes()
    texels = np.frombuffer(data[-SIZE * SIZE * 4:], np.uint8).reshape(SIZE, SIZE, 4).astype(np.float64)
    # Half a step more, because SmallVCM rounds down.
    return (texels[..., :3] + 0.5) * (np.exp2(texels[..., 3:] - 136) * (texels[..., 3:] > 0))


def processor_seconds(command, **options):
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run(command, capture_output=True, text=True, **options)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    if done.returncode != 0:
        raise RuntimeError(f"{' '.join(map(str, command))}\n{done.stderr}")
    return after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime, done.stdout


def theirs(index, algorithm, seconds, seed, folder):
    """SmallVCM's picture and its seconds. One thread by taskset: the program has no flag for it."""
    picture = folder / "theirs.hdr"
    command = ["taskset", "-c", "0", os.environ["SMALLVCM"], "-s", str(index), "-a", algorithm, "-t", str(seconds)]
    spent, _ = processor_seconds([*command, "-o", str(picture)], env={**os.environ, "SEED": str(seed)})
    return read_hdr(picture), spent


def ours(description, method, spp, seed, folder):
    """Our picture, its seconds, and the method that rendered it."""
    picture = folder / "ours.pfm"
    command = [PROGRAM, "render", "--reconstruct", "off", str(description), "-o", str(picture), "--spp", str(spp)]
    command += ["--method", *method.split()]
    # Without an audit `auto` has no cache.
    command += [] if method == "auto" else ["--audit", "off"]
    spent, out = processor_seconds([*command, "--seed", str(seed), "--threads", "1", "--json"])
    return read_pfm(picture), spent, json.loads(out)


def relmse(picture, reference):
    return float(np.mean((picture - reference) ** 2 / (reference**2 + 0.01 * np.mean(reference) ** 2)))


def samples_for(description, method, seconds, folder):
    """Samples that take about `seconds`: by the difference of two short pictures."""
    few, many = (ours(description, method, n, 99, folder)[1] for n in (4, 12))
    each = max((many - few) / 8, 1e-3)
    return max(4, 4 * round((seconds - max(few - 4 * each, 0)) / each / 4))


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("scenes", nargs="*", default=list(SCENES))
    parser.add_argument("--seconds", type=float, default=20)
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--reference-seconds", type=float, default=300)
    parser.add_argument("--ours", nargs="*", default=OURS)
    parser.add_argument("--theirs", nargs="*", default=THEIRS)
    arguments = parser.parse_args()
    for name in arguments.scenes:
        with tempfile.TemporaryDirectory() as folder:
            folder = Path(folder)
            description = scene(name, folder)
            print(f"\n{name}: {arguments.seconds} s of one thread, {SIZE} x {SIZE}")
            if arguments.theirs:
                truth = read_reference(name, "theirs", lambda: theirs(
                    SCENES[name], "bpt", arguments.reference_seconds, 1000, folder)[0])
            for algorithm in arguments.theirs:
                report("SmallVCM", algorithm, truth, [
                    theirs(SCENES[name], algorithm, arguments.seconds, seed, folder) for seed in range(arguments.seeds)])
            if not arguments.ours:
                continue
            truth = read_reference(name, "ours", lambda: reference(
                description, arguments.reference_seconds, folder))
            for method in arguments.ours:
                spp = samples_for(description, method, arguments.seconds, folder)
                report("halflight", f"{method} ({spp})", truth, [
                    ours(description, method, spp, seed, folder)[:2] for seed in range(arguments.seeds)])


def report(program, method, truth, runs):
    """Medians over `runs`: mean over that of the reference, error, efficiency."""
    errors = [relmse(picture, truth) for picture, _ in runs]
    mean = statistics.median(picture.mean() / truth.mean() for picture, _ in runs)
    efficiency = statistics.median(1 / (error * spent) for error, (_, spent) in zip(errors, runs))
    print(f"  {program:9} {method:12} mean {mean:.4f}  relMSE {statistics.median(errors):.2e}  {efficiency:.2f} /s",
          flush=True)


def reference(description, seconds, folder):
    """The mean of two pictures of `path` with photons by seeds that no measured picture has."""
    spp = samples_for(description, "path", seconds / 2, folder)
    return sum(ours(description, "path", spp, seed, folder)[0] for seed in (1000, 1001)) / 2


def read_reference(name, whose, render):
    """A reference of an earlier run, or a new one."""
    cache = Path(__file__).resolve().parent.parent / "output" / "peers" / f"smallvcm-{name}-{whose}.npy"
    if not cache.exists():
        cache.parent.mkdir(parents=True, exist_ok=True)
        np.save(cache, render())
    return np.load(cache)


if __name__ == "__main__":
    main()
