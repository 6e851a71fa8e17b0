"""Error after the same processor time: the ambient cache of Radiance's `rpict` beside `--method irradiance-cache`.

    python3 tests/peers/radiance.py [--reference-spp 1024] [--target 1e-3] [cornell two-rooms sponza-dabrovic]

Scenes of this repository, and one of the published ones (`HALFLIGHT_SCENES`), with diffuse materials alone, and lamps that reflect nothing, in the words of both: materials
`plastic` without specularity, lamps `light`, radiance for radiance (Radiance's 179 lumen per watt is for those who want
candelas; its pixels are watts). Textures are their mean colour, and normals those of the triangles, for both; a lamp that is a sphere of
triangles is a sphere there. Both run on one thread; seconds are those of the processor, for the whole process. Errors
are against our path tracer, whose own noise is subtracted; how far the means are apart is printed beside. `rpict` renders
more pixels than are wanted, jittered, and squares of them are averaged: the time for that is not counted. Its settings
are a sweep of `-aa`, `-ad`, `-as`, `-ar`, `-ab`, `-ds` and of the pixels; what counts is the fastest that is good enough, for the error
asked for and for others that both reach. `path` stands beside, by one picture.

`RADIANCE` names a folder with the programs; without it pyradiance from PyPI is installed into `tests/peers/venv-radiance`.
"""

import argparse
import os
import resource
import subprocess
import sys
import venv
from pathlib import Path

import workbench
from measure import Sums, relmse, relmse_of_noise
from workbench import np

PYRADIANCE = "pyradiance==1.3.1"
FOLDER = workbench.OUTPUT / "radiance"
SCENES = {
    "cornell": {
        "obj": "scenes/cornell/cornell.obj",
        "size": (512, 512),
        "camera": {"eye": (278, 273, -800), "look-at": (278, 273, 279), "up": (0, 1, 0), "fov": 37.5},
        "target": 1e-3,
    },
    "two-rooms": {
        "obj": "scenes/two-rooms/two-rooms.obj",
        "size": (320, 240),
        "camera": {"eye": (0.6, 1.5, 3.8), "look-at": (3, 0.9, 0.6), "up": (0, 1, 0), "fov": 55},
        "target": 2e-3,
    },
    "sponza-dabrovic": {
        "obj": os.path.join(os.environ.get("HALFLIGHT_SCENES", "."), "sponza-dabrovic/sponza-dabrovic.obj"),
        "size": (192, 144),
        "camera": {
            "eye": (14.4499, 6.89415, -1.18547),
            "look-at": (13.45630589820548, 6.78438065161636, -1.1586101594462552),
            "up": (-0.10970821656511949, 0.9939567862130738, 0.003743575707618994),
            "fov": 74.09584038370595,
        },
        "target": 2e-3,
        "sphere": True,
    },
}
# -aa, -ar, -ad; and -ab, -ds.
COARSE = [(0.6, 16, 64), (0.5, 16, 128), (0.5, 8, 256), (0.5, 16, 256), (0.4, 8, 512), (0.4, 16, 256), (0.3, 8, 512), (0.4, 32, 256)]
# Where light comes through a slit, finer shadows are worth more than records; more bounces are everywhere.
FINE = [(0.5, 16, 256, 8, 0.05), (0.4, 16, 512, 8, 0.05), (0.5, 16, 256, 8, 0.2), (0.4, 16, 512, 8, 0.2)]
SWEEP = [(*settings, 5, 0.2) for settings in COARSE] + FINE
# Nine for a pixel leave noise at edges, which no other setting takes away.
OVERSAMPLING = (3, 6)
OURS = [(rays, error, spp) for rays in (256, 1024) for error in (1e-4, 3e-4) for spp in (4, 16, 64)]
OURS += [(1024, 1e-4, 256), (4096, 1e-4, 64), (4096, 1e-4, 256)]
# Errors for which the fastest of both are told, besides the one asked for.
ROUND_ERRORS = [m * 10.0**e for e in range(-1, -4, -1) for m in (5, 2, 1)]
FIRST_REFERENCE_SEED = 1000
CHUNK = 128


def programs():
    """The folder of `oconv` and `rpict`."""
    if "RADIANCE" in os.environ:
        return Path(os.environ["RADIANCE"])  # RAYPATH is set already, then.
    folder = workbench.HERE / "venv-radiance"
    if not list(folder.glob("lib/python*/site-packages/pyradiance/bin/rpict*")):
        venv.create(folder, with_pip=True, clear=True)
        subprocess.check_call([folder / "bin" / "python", "-m", "pip", "install", "--quiet", PYRADIANCE])
    found = next(folder.glob("lib/python*/site-packages/pyradiance/bin"))
    os.environ["RAYPATH"] = str(found.parent / "lib")
    return found


def read_diffuse(path):
    """Faces as (material, corners), and materials as {name: (Kd, Ke)}, of an OBJ file."""
    positions, faces, material, library = [], [], None, None
    for line in path.read_text(errors="replace").splitlines():
        key, _, rest = line.partition(" ")
        if key == "v":
            positions.append([float(x) for x in rest.split()[:3]])
        elif key == "usemtl":
            material = rest.strip()
        elif key == "mtllib":
            library = path.parent / rest.strip()
        elif key == "f":
            faces.append((material, [positions[int(corner.split("/")[0]) - 1] for corner in rest.split()]))
    materials, name = {}, None
    for line in library.read_text().splitlines():
        key, _, rest = line.partition(" ")
        if key == "newmtl":
            name = rest.strip()
            materials[name] = {"Kd": [0.0] * 3, "Ke": [0.0] * 3}
        elif key in ("Kd", "Ke"):
            materials[name][key] = [float(x) for x in rest.split()]
        elif key == "map_Kd":
            texels = workbench.mi.Bitmap(str(library.parent / rest.strip()))
            linear = np.array(texels.convert(workbench.mi.Bitmap.PixelFormat.RGB, workbench.mi.Struct.Type.Float32, False))
            materials[name]["Kd"] = [float(x) for x in linear.mean(axis=(0, 1))]
    for values in materials.values():
        if any(values["Ke"]):
            values["Kd"] = [0.0] * 3
    return faces, materials


def sphere(name, triangles):
    """The sphere of `triangles`, of the same area."""
    corners = np.array(triangles)
    center = (corners.min(axis=(0, 1)) + corners.max(axis=(0, 1))) / 2
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    radius = np.sqrt(np.linalg.norm(across, axis=1).sum() / 2 / (4 * np.pi))
    return f"{name} sphere of_{name}\n0\n0\n4 {' '.join(f'{x:.9g}' for x in (*center, radius))}\n"


def write_scene(name, path, with_sphere=False):
    """The same scene twice: `NAME.obj` for us, `NAME.rad` for Radiance."""
    faces, materials = read_diffuse(path)
    words = lambda values: " ".join(f"{x:.9g}" for x in values)
    obj, rad, count = [f"mtllib {name}.mtl"], [], 0
    for material, values in materials.items():
        if any(values["Ke"]):
            rad.append(f"void light {material}\n0\n0\n3 {words(values['Ke'])}\n")
        else:
            rad.append(f"void plastic {material}\n0\n0\n5 {words(values['Kd'])} 0 0\n")
    lamps = {}
    for i, (material, corners) in enumerate(faces):
        obj += [f"usemtl {material}", *(f"v {words(corner)}" for corner in corners)]
        obj.append("f " + " ".join(str(count + k + 1) for k in range(len(corners))))
        count += len(corners)
        if with_sphere and any(materials[material]["Ke"]):
            lamps.setdefault(material, []).append(corners)
            continue
        numbers = "\n".join(words(corner) for corner in corners)
        rad.append(f"{material} polygon face{i}\n0\n0\n{3 * len(corners)}\n{numbers}\n")
    rad += [sphere(material, triangles) for material, triangles in lamps.items()]
    mtl = [f"newmtl {m}\nKd {words(v['Kd'])}\nKe {words(v['Ke'])}" for m, v in materials.items()]
    FOLDER.mkdir(parents=True, exist_ok=True)
    (FOLDER / f"{name}.mtl").write_text("\n".join(mtl) + "\n")
    (FOLDER / f"{name}.obj").write_text("\n".join(obj) + "\n")
    (FOLDER / f"{name}.rad").write_text("\n".join(rad))


def timed(command):
    """Runs it; its output, and the processor seconds that it took."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run([str(word) for word in command], capture_output=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    if done.returncode != 0:
        raise RuntimeError(f"{' '.join(map(str, command))}\n{done.stderr.decode(errors='replace')}")
    return done.stdout, after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime


def read_hdr(data):
    """A Radiance picture as a float array (height, width, 3)."""
    header, _, rest = data.partition(b"\n\n")
    resolution, _, body = rest.partition(b"\n")
    words = resolution.split()
    height, width = int(words[1]), int(words[3])
    if words[0] != b"-Y" or b"EXPOSURE" in header:
        raise ValueError("a picture in another order, or exposed")
    lines, at = np.zeros((height, 4, width), np.uint8), 0
    body = np.frombuffer(body, np.uint8)
    for y in range(height):
        if not (body[at] == 2 and body[at + 1] == 2):
            raise ValueError("a scanline in the old format")
        at += 4
        for channel in range(4):
            x = 0
            while x < width:
                count = int(body[at])
                if count > 128:
                    lines[y, channel, x : x + count - 128] = body[at + 1]
                    x, at = x + count - 128, at + 2
                else:
                    lines[y, channel, x : x + count] = body[at + 1 : at + 1 + count]
                    x, at = x + count, at + 1 + count
    mantissa, exponent = lines[:, :3].astype(np.float64), lines[:, 3].astype(np.int32)
    scale = np.where(exponent > 0, np.exp2(exponent - 136.0), 0.0)
    # The middle of what is rounded down.
    return ((mantissa + 0.5) * scale[:, None]).transpose(0, 2, 1)


def rpict(bin_folder, name, scene, settings, oversampling):
    accuracy, resolution, divisions, bounces, substructuring = settings
    width, height = scene["size"]
    camera = scene["camera"]
    direction = np.subtract(camera["look-at"], camera["eye"])
    half = np.tan(np.radians(camera["fov"] / 2))
    across = 2 * np.degrees(np.arctan(half * width / height))
    view = ["-vtv", "-vp", *camera["eye"], "-vd", *direction, "-vu", *camera["up"], "-vh", across, "-vv", camera["fov"]]
    quality = ["-ab", bounces, "-aa", accuracy, "-ar", resolution, "-ad", divisions, "-as", divisions // 4]
    limits = ["-lr", bounces, "-lw", 1e-3, "-dj", 1, "-ds", substructuring, "-dt", 0, "-dc", 1, "-ps", 1, "-pj", 1, "-pa", 0]
    pixels = ["-x", width * oversampling, "-y", height * oversampling]
    command = [bin_folder / "rpict", *view, *quality, *limits, *pixels, FOLDER / f"{name}.oct"]
    data, seconds = timed(command)
    picture = read_hdr(data)
    squares = picture.reshape(height, oversampling, width, oversampling, 3)
    return squares.mean(axis=(1, 3)), seconds


def halflight(program, name, scene, method, spp, seed, threads, extra=()):
    camera = scene["camera"]
    view = [w for key, value in camera.items() for w in (f"--{key}", ",".join(map(str, np.atleast_1d(value))))]
    picture = FOLDER / f"{name}-{os.getpid()}.exr"
    command = [program, "render", "--reconstruct", "off", FOLDER / f"{name}.obj", "-o", picture, "--method", method, "--spp", spp, "--seed", seed]
    command += ["--threads", threads, "--size", "{}x{}".format(*scene["size"]), *view, *extra]
    _, seconds = timed(command)
    image = workbench.read_picture(picture)
    picture.unlink()
    return image, seconds


def reference(program, name, scene, spp):
    """`Sums` of our path tracer, kept in the output folder and resumed after a stop."""
    path = FOLDER / "reference-{}-{}x{}.npz".format(name, *scene["size"])
    sums = Sums()
    if path.exists():
        kept = np.load(path)
        sums.count, sums.mean, sums.squares = int(kept["count"]), kept["mean"], kept["squares"]
    while sums.count * CHUNK < spp:
        sums.add(halflight(program, name, scene, "path", CHUNK, FIRST_REFERENCE_SEED + sums.count, workbench.THREADS)[0])
        np.savez(path, count=sums.count, mean=sums.mean, squares=sums.squares)
    return sums


def compare(name, arguments, program, bin_folder):
    scene = SCENES[name] | ({"size": tuple(arguments.size)} if arguments.size else {})
    write_scene(name, workbench.ROOT / scene["obj"], scene.get("sphere", False))
    with open(FOLDER / f"{name}.oct", "wb") as octree:
        subprocess.check_call([bin_folder / "oconv", "-w", FOLDER / f"{name}.rad"], stdout=octree)
    truth = reference(program, name, scene, arguments.reference_spp)
    noise = relmse_of_noise(truth.variance(), truth.mean)
    print(f"\n{name}: reference of {truth.count * CHUNK} samples, relMSE of its noise {noise:.1e}\n")
    print("| who | settings | relMSE | mean | processor s |\n|---|---|---|---|---|", flush=True)
    rows = {"rpict": [], "path": [], "halflight": []}

    def note(who, settings, picture, seconds):
        error, mean = relmse(picture, truth.mean) - noise, picture.mean() / truth.mean.mean()
        rows[who].append((error, seconds, settings))
        print(f"| {who} | {settings} | {error:.2e} | {mean:.4f} | {seconds:.2f} |", flush=True)
        workbench.write_picture(FOLDER / f"{name}-{who}-{len(rows[who])}.exr", picture)

    picture, seconds = halflight(program, name, scene, "path", CHUNK, 1, 1, ["--audit", "off"])
    note("path", f"{CHUNK} spp", picture, seconds)
    for rays, error, spp in OURS:
        told = f"{rays} rays, error {error:g}, {spp} spp"
        if arguments.only not in told:
            continue
        extra = ["--audit", "off", "--cache-rays", rays, "--cache-error", error]
        picture, seconds = halflight(program, name, scene, "irradiance-cache", spp, 1, 1, extra)
        note("halflight", told, picture, seconds)
    for settings in SWEEP[arguments.sweep :]:
        for oversampling in OVERSAMPLING[: arguments.oversampling]:
            told = "-aa {:g} -ar {} -ad {} -ab {} -ds {:g}".format(*settings) + f", {oversampling}² pixels"
            note("rpict", told, *rpict(bin_folder, name, scene, settings, oversampling))
    print("\nFastest that are good enough; `path` as if its error fell as one over its samples:\n")
    print("| relMSE | halflight | s | rpict | s | ratio | path s | ratio |\n|---|---|---|---|---|---|---|---|")
    for target in sorted({arguments.target or scene["target"], *ROUND_ERRORS}, reverse=True):
        fastest = lambda of: min(((row[1], row[2]) for row in of if row[0] <= target), default=(None, "none"))
        (ours, how), (theirs, settings) = fastest(rows["halflight"]), fastest(rows["rpict"])
        if ours or theirs:
            told = lambda seconds: f"{seconds:.2f}" if seconds else ""
            ratio = lambda other: f"{other / ours:.1f}" if ours and other else ""
            by_path = rows["path"][0][0] * rows["path"][0][1] / target
            print(f"| {target:g} | {how} | {told(ours)} | {settings} | {told(theirs)} | {ratio(theirs)} | {told(by_path)} | {ratio(by_path)} |")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", nargs="*", default=["cornell", "two-rooms"])
    parser.add_argument("--reference-spp", type=int, default=1024)
    parser.add_argument("--target", type=float, help="relMSE [default: of the scene]")
    parser.add_argument("--size", type=int, nargs=2, metavar=("W", "H"), help="pixels [default: of the scene]")
    parser.add_argument("--sweep", type=int, default=0, help="rpict's settings from this one on [default: the first]")
    parser.add_argument("--only", default="", help="of the settings of the cache those whose words hold this")
    parser.add_argument("--oversampling", type=int, default=len(OVERSAMPLING), help="only so many numbers of its pixels")
    arguments = parser.parse_args()
    program, bin_folder = workbench.halflight_program(), programs()
    print(f"{workbench.machine()}; {PYRADIANCE}; one thread each", file=sys.stdout)
    for name in arguments.scenes:
        compare(name, arguments, program, bin_folder)


if __name__ == "__main__":
    main()
