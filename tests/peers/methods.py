"""Every method on every scene after the same time, and `auto` against the best of them.

    HALFLIGHT=program python3 tests/peers/methods.py [--budgets 1.5 7.5] [--scenes NAME,...] [--methods NAME,...] [--rooms SEED ...]

`--rooms` measures rooms by random numbers (random_rooms.py) in place of the scenes. A second table has the mean of the pictures over that of the reference, and how many standard errors it is from one: z, by
the spread of two or more seeds. Biased methods may differ; others may not. Each method renders 128 x 128 pixels for the seconds of a budget on one thread, one seed after the other. The table
has relMSE; the regret of `auto` is its error over that of the best other method. References are pairs of
pictures of other seeds by a method that suits the scene, kept in the output folder: in the product of the
differences from both their noise cancels. Runs are kept, too: a second call renders those that are missing. Needs numpy, and
the published scenes in HALFLIGHT_SCENES. `--reconstruct auto` measures the pictures that the program shows by default,
and `--processor-time` gives the program the clock of its own processor time, by a library that `cc` builds, so that other
work on the machine changes little.
"""

import argparse
import json
import math
import os
import subprocess
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np

import random_rooms
from ablation import OWN, ROOT, read_pfm
from measure import relmse, relmse_of_pair
from published import published
from scene_file import write_scene

OUTPUT = ROOT / "tests" / "output" / "methods"
PROGRAM = os.environ.get("HALFLIGHT", str(ROOT / "target" / "release" / "halflight"))
SIZE = (128, 128)
METHODS = ["path", "irradiance-cache", "radiance-cache", "sppm", "bdpt", "vcm", "mlt", "instant-radiosity", "photon-map", "auto"]
CLOCK = """
#define _GNU_SOURCE
#include <sys/syscall.h>
#include <time.h>
#include <unistd.h>
int clock_gettime(clockid_t id, struct timespec *time) {
    return syscall(SYS_clock_gettime, id == CLOCK_MONOTONIC ? CLOCK_PROCESS_CPUTIME_ID : id, time);
}
"""
HARD = Path(__file__).resolve().parent / "scenes" / "hard"

# Scenes, and the method of their references.
SCENES = {
    "cornell-box-bitterli": "path", "cbox-mitsuba": "path", "living-room": "path", "staircase": "path",
    "sponza-dabrovic": "path", "veach-ajar": "path", "veach-door": "bdpt",
    "veach-bidir": "bdpt", "lux-causticcube": "sppm", "torus": "path", "caustic-glass": "vcm",
    "water-caustic": "sppm", "two-rooms": "bdpt", "glossy": "path", "caustic": "path", "up-light": "path",
    "glass-lamp": "sppm", "keyhole": "bdpt", "rings": "path", "mirror-ball": "sppm", "glass-ball": "sppm",
}


def scene_file(name, folder):
    """The scene `name` as a file that the program reads."""
    if name in OWN:
        return OWN[name]
    if (HARD / f"{name}.toml").exists():
        return HARD / f"{name}.toml"
    path = Path(folder) / f"{name}.toml"
    if name.startswith("room-"):
        return random_rooms.room(folder, int(name[5:]))
    if not path.exists():
        write_scene(path, published(name, SIZE))
    return path


def reference_method(name):
    """Method of the reference of scene `name`."""
    if not name.startswith("room-"):
        return SCENES[name]
    return {"door": "bdpt", "spot": "bdpt", "glass ball": "sppm", "sun": "bdpt"}.get(random_rooms.light(int(name[5:])), "path")


def use_processor_time():
    """Gives the programs of this process the clock of their processor time."""
    source, library = OUTPUT / "clock.c", OUTPUT / "clock.so"
    source.write_text(CLOCK)
    subprocess.run(["cc", "-O2", "-shared", "-fPIC", "-o", str(library), str(source)], check=True)
    os.environ["LD_PRELOAD"] = str(library)


def render(scene, flags, threads=1, reconstruct="off"):
    """The picture and the facts of `--json` of one render."""
    with tempfile.TemporaryDirectory() as folder:
        picture = Path(folder) / "picture.pfm"
        command = [PROGRAM, "render", "--reconstruct", reconstruct, str(scene), "--size", "{}x{}".format(*SIZE), "--json", "-o", str(picture)]
        done = subprocess.run(command + ["--threads", str(threads)] + flags, capture_output=True, text=True)
        if done.returncode not in (0, 3):
            raise RuntimeError(f"{command} {flags}: {done.stderr}")
        return read_pfm(picture), json.loads(done.stdout)


def reference(name, scene, seconds):
    """Two converged pictures of seeds of their own."""
    kept = OUTPUT / (f"{name}.npz" if SIZE == (128, 128) else f"{name}-{SIZE[0]}.npz")
    if not kept.exists():
        flags = ["--time", f"{seconds}s", "--method", reference_method(name)]
        pair = [render(scene, [*flags, "--seed", seed])[0] for seed in ("1000", "1001")]
        np.savez(kept, pair=pair)
        print(f"# {name}: {reference_method(name)}, mean with relMSE {left(pair):.2e}", flush=True)
    return np.load(kept)["pair"]


def left(pair):
    """Relative variance of the mean of two pictures."""
    mean = (pair[0] + pair[1]) / 2
    return relmse(pair[0], mean)


def one(job):
    """Row of the log: a method on a scene for a budget."""
    name, scene, method, budget, seed, pair, reconstruct = job
    flags = ["--time", f"{budget}s", "--seed", str(seed), "--method", method]
    picture, facts = render(scene, flags, reconstruct=reconstruct)
    error = max(relmse_of_pair(picture, pair), 1e-9)
    return {"scene": name, "method": method, "chosen": facts["method"], "budget": budget, "seed": seed, "spp": facts["spp"],
            "relmse": error, "mean": float(picture.mean() / pair.mean()), "seconds": facts["seconds"]["render"]}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--budgets", type=float, nargs="+", default=[1.5, 7.5])
    parser.add_argument("--scenes", default=",".join(SCENES))
    parser.add_argument("--rooms", type=int, nargs="+", help="seeds of random rooms")
    parser.add_argument("--methods", default=",".join(METHODS))
    parser.add_argument("--seeds", type=int, default=1)
    parser.add_argument("--reference-seconds", type=int, default=60)
    parser.add_argument("--log", default=str(OUTPUT / "runs.jsonl"))
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--side", type=int, default=128, help="of pictures and references; other sides need a log of their own")
    parser.add_argument("--reconstruct", choices=["auto", "off"], default="off", help="auto needs a log of its own")
    parser.add_argument("--processor-time", action="store_true")
    a = parser.parse_args()
    OUTPUT.mkdir(parents=True, exist_ok=True)
    global SIZE
    SIZE = (a.side, a.side)
    if a.processor_time:
        use_processor_time()
    log = Path(a.log)
    rows = [json.loads(line) for line in log.read_text().splitlines()] if log.exists() else []
    known = {(row["scene"], row["method"], row["budget"], row["seed"]) for row in rows}
    with tempfile.TemporaryDirectory() as folder, ThreadPoolExecutor(a.jobs) as pool, open(log, "a") as out:
        names = [f"room-{seed}" for seed in a.rooms] if a.rooms else a.scenes.split(",")
        files = {name: scene_file(name, folder) for name in names}
        converged = dict(zip(names, pool.map(lambda name: reference(name, files[name], a.reference_seconds), names)))
        jobs = [
            (name, files[name], method, budget, seed, converged[name], a.reconstruct)
            for name in names for budget in a.budgets for seed in range(1, a.seeds + 1)
            for method in a.methods.split(",") if (name, method, budget, seed) not in known
        ]
        for row in pool.map(one, jobs):
            rows.append(row)
            out.write(json.dumps(row) + "\n")
            out.flush()
    for budget in a.budgets:
        chosen = [row for row in rows if row["budget"] == budget and row["scene"] in names]
        table(chosen, budget)
        if a.seeds > 1:
            agreement(chosen, budget, converged)


def table(rows, budget):
    """Errors of all methods after `budget` seconds, and the regret of `auto`."""
    methods = [method for method in METHODS if any(row["method"] == method for row in rows)]
    print(f"\n{budget:g} s\n\n| scene | " + " | ".join(methods) + " | chosen | regret |")
    print("|---" * (len(methods) + 3) + "|")
    regrets = []
    for scene in dict.fromkeys(row["scene"] for row in rows):
        error = {}
        for method in methods:
            logs = [math.log(row["relmse"]) for row in rows if (row["scene"], row["method"]) == (scene, method)]
            if logs:
                error[method] = math.exp(sum(logs) / len(logs))
        others = [value for method, value in error.items() if method != "auto"]
        best = min(others, default=float("nan"))
        cells = [("**{:.1e}**" if error.get(m) == best else "{:.1e}").format(error[m]) if m in error else "–" for m in methods]
        chosen = {row["chosen"] for row in rows if (row["scene"], row["method"]) == (scene, "auto")}
        regret = error["auto"] / best if "auto" in error else float("nan")
        regrets += [regret] if regret == regret else []
        print(f"| {scene} | " + " | ".join(cells) + f" | {', '.join(sorted(chosen))} | {regret:.2f} |")
    if regrets:
        print(f"\nGeometric mean of the regret: {math.exp(sum(map(math.log, regrets)) / len(regrets)):.2f}")


def mean_error(pair):
    """Relative standard error of the mean of both pictures, by their difference."""
    difference = (pair[0] - pair[1]) / 2
    return float(np.sqrt((difference**2).sum()) / ((pair[0] + pair[1]) / 2).sum())


def agreement(rows, budget, references):
    """Mean over that of the reference in percent, and z."""
    methods = [method for method in METHODS if any(row["method"] == method for row in rows)]
    print(f"\nmeans after {budget:g} s\n\n| scene | reference | " + " | ".join(methods) + " |")
    print("|---" * (len(methods) + 2) + "|")
    for scene in dict.fromkeys(row["scene"] for row in rows):
        own = mean_error(references[scene])
        cells = []
        for method in methods:
            means = np.array([row["mean"] for row in rows if (row["scene"], row["method"]) == (scene, method)])
            if len(means) < 2:
                cells.append("–")
                continue
            error = math.hypot(means.std(ddof=1) / math.sqrt(len(means)), own)
            cells.append(f"{100 * (means.mean() - 1):+.1f} ({(means.mean() - 1) / error:+.1f})")
        print(f"| {scene} | ±{100 * own:.2f} | " + " | ".join(cells) + " |")


if __name__ == "__main__":
    main()
