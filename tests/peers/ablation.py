"""Efficiency of each mechanism: everything, beside everything but one.

    HALFLIGHT=program python3 tests/peers/ablation.py [--study NAME] [--arm NAME]... [--budgets 3 15]

For each method and scene the samples per pixel are chosen so that the program as it is takes about as many
seconds of one processor as the budget says. Every arm then renders 256 x 256 pixels with these samples, the arms
in turn for each seed, one thread each. The efficiency is 1 / (relMSE x processor seconds), loading excluded;
processor seconds, and not those of the clock, so that other work on the machine changes little. Irradiance caches,
which are filled for half of the time there is, render for the seconds of the budget by the clock with --timed. A row gives the
efficiency of the program as it is over that without the mechanism: 1.10 means that it brings ten percent. The
last columns count the intervals of error that hold, with and without it.

Mechanisms that halflight still has are left out by flags. Those that it had are left out by the environment variable
HALFLIGHT_WITHOUT of a program built at 55dd8ea with `ablation.patch` applied.

References are pictures of other seeds by a method that suits the scene, kept in the output folder; the noise that
they say of themselves is subtracted. Needs numpy, and the published scenes in HALFLIGHT_SCENES.
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

from published import SCENES, published
from scene_file import write_scene

ROOT = Path(__file__).resolve().parent.parent.parent
OUTPUT = ROOT / "tests" / "output" / "ablation"
PROGRAM = os.environ.get("HALFLIGHT", str(ROOT / "target" / "release" / "halflight"))
SIZE = "256x256"

# Method, its scenes, and its arms: flags, and mechanisms that the environment leaves out.
PATH = ["--method", "path"]
CACHE = ["--method", "irradiance-cache"]
SPPM = ["--method", "sppm"]
OWN = {
    "caustic": ROOT / "scenes/caustic/caustic.toml",
    "glossy": ROOT / "scenes/glossy/glossy.toml",
    "two-rooms": ROOT / "scenes/two-rooms/two-rooms.toml",
}
WATER = "cornell-mcguire/CornellBox-Water"
ORIGINAL = "cornell-mcguire/CornellBox-Original"
STUDY = {
    "path": (
        PATH,
        ["cornell-box-bitterli", "living-room", "staircase", "sponza-dabrovic", "glass-of-water",
         "lux-causticcube", "caustic", WATER, "cbox-mitsuba", ORIGINAL],
        {
            "borders": ([], "borders"),
            "images": ([], "images"),
            "prefetch": ([], "prefetch"),
            "adaptive": (["--adaptive", "on"], ""),
            "balls": ([], "balls"),
            "glimpses": ([], "glimpses"),
        },
    ),
    "irradiance-cache": (
        CACHE,
        ["cornell-box-bitterli", "living-room", "staircase", "sponza-dabrovic", "cbox-mitsuba"],
        {
            "edges": ([], "edges"),
            "spots": ([], "spots"),
            "second looks": ([], "second-looks"),
            "ray budget": ([], "budget"),
            "256 rays": (["--cache-rays", "256"], ""),
            "light samples": ([], "light-samples"),
            "trials, 64 rays, 4 light samples": ([], "budget,lights-4"),
            "trials, 256 rays, 4 light samples": (["--cache-rays", "256"], "lights-4"),
            "images": ([], "images"),
            "borders": ([], "borders"),
            "gather photons": (["--gather", "photons"], ""),
        },
    ),
    "sppm": (
        SPPM,
        ["lux-causticcube", "torus", "caustic", "caustic-glass", WATER, "sponza-dabrovic"],
        {"chains": ([], "chains"), "balls": ([], "balls"), "clearance": ([], "clearance"), "borders": ([], "borders")},
    ),
    "keep": (
        PATH,
        ["cornell-box-bitterli", "living-room", "staircase", "caustic", WATER],
        {
            "reuse": (["--reuse", "off"], ""),
            "windows": (["--windows", "off"], ""),
            "caustics": (["--caustics", "off"], ""),
        },
    ),
}


def scene_file(name, folder):
    """The scene `name` as a file that the program reads."""
    if name in OWN:
        return OWN[name]
    path = Path(folder) / f"{name.replace('/', '-')}.toml"
    if not path.exists():
        if "/" in name:
            file = SCENES / f"{name}.obj"
            camera = {"eye": [0.0, 1.0, 3.4], "look_at": [0.0, 1.0, 0.0], "up": [0.0, 1.0, 0.0], "fov": 36.0}
            write_scene(path, {"mesh": [{"file": str(file)}], "camera": camera})
        else:
            write_scene(path, published(name, (256, 256)))
    return path


def run(scene, flags, without="", threads=1):
    """The picture, the facts of `--json`, and the processor seconds of one render."""
    with tempfile.TemporaryDirectory() as folder:
        picture = Path(folder) / "picture.pfm"
        command = [PROGRAM, "render", "--reconstruct", "off", str(scene), "--size", SIZE, "--json", "--threads", str(threads)]
        environment = {**os.environ, "HALFLIGHT_WITHOUT": without}
        child = subprocess.Popen(
            command + ["-o", str(picture)] + flags, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, env=environment
        )
        facts = child.stdout.read()
        _, status, usage = os.wait4(child.pid, 0)
        child.returncode = os.waitstatus_to_exitcode(status)
        if child.returncode not in (0, 3):
            raise RuntimeError(f"{command} {flags} {without}: {child.returncode}")
        return read_pfm(picture), json.loads(facts), usage.ru_utime


def read_pfm(path):
    with open(path, "rb") as file:
        kind, size, scale = (file.readline() for _ in range(3))
        width, height = map(int, size.split())
        data = np.frombuffer(file.read(), "<f4" if float(scale) < 0 else ">f4").astype(np.float64)
        return data.reshape(height, width, 3 if kind.strip() == b"PF" else 1)


def relmse(picture, reference):
    weight = reference**2 + 0.01 * np.mean(reference) ** 2
    return float(np.mean((picture - reference) ** 2 / weight))


def reference(name, scene, seconds):
    """A converged picture and the relMSE that is left in it, by its own estimate."""
    OUTPUT.mkdir(parents=True, exist_ok=True)
    kept = OUTPUT / f"{name.replace('/', '-')}.npz"
    if not kept.exists():
        flags = ["--time", f"{seconds}s", "--seed", "1000", "--method", "auto"]
        picture, facts, _ = run(scene, flags, threads=2)
        np.savez(kept, picture=picture, relmse=facts["error"]["relmse"])
        print(f"# {name}: reference by {facts['method']}, {facts['spp']} spp, relMSE {facts['error']['relmse']:.2e}")
    data = np.load(kept)
    return data["picture"], float(data["relmse"])


def samples(scene, flags, loading, budgets):
    """Samples per pixel for each budget of processor seconds, a power of the root of two."""
    spp, seconds = 8, []
    while True:
        seconds.append((spp, run(scene, flags + ["--spp", str(spp)])[2] - loading))
        if seconds[-1][1] > 0.7 * min(budgets) or spp >= 4096:
            break
        spp *= 2
    (a, x), (b, y) = ([(0, 0.0)] + seconds)[-2:]
    slope = max((y - x) / (b - a), 1e-6)
    return [max(2, 2 * round((b + (budget - y) / slope) / 2)) for budget in budgets]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--study", action="append", choices=list(STUDY))
    parser.add_argument("--arm", action="append", help="only these")
    parser.add_argument("--scene", action="append", help="only these")
    parser.add_argument("--budgets", type=float, nargs="+", default=[3, 15])
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--reference-seconds", type=int, default=60)
    parser.add_argument("--log", default=str(OUTPUT / "runs.jsonl"))
    parser.add_argument("--timed", action="store_true", help="irradiance caches by the clock")
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--references-only", action="store_true")
    a = parser.parse_args()
    OUTPUT.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as folder, ThreadPoolExecutor(a.jobs) as pool, open(a.log, "a") as log:
        for study in a.study or STUDY:
            flags, scenes, arms = STUDY[study]
            for name in [name for name in scenes if not a.scene or name in a.scene]:
                scene = scene_file(name, folder)
                converged, left = reference(name, scene, a.reference_seconds)
                if a.references_only:
                    continue
                loading = run(scene, ["--method", "path", "--caustics", "off", "--reuse", "off", "--windows", "off",
                                      "--spp", "1", "--max-depth", "1"], "images")[2]
                timed = study == "irradiance-cache" and a.timed
                counts = [0] * len(a.budgets) if timed else samples(scene, flags, loading, a.budgets)
                for budget, spp in zip(a.budgets, counts):
                    jobs = [(seed, "all", [], "") for seed in range(a.seeds)]
                    for arm, (extra, without) in arms.items():
                        if not a.arm or arm in a.arm:
                            jobs += [(seed, arm, extra, without) for seed in range(a.seeds)]
                    jobs.sort(key=lambda job: job[0])

                    def one(job):
                        seed, arm, extra, without = job
                        stop = ["--time", f"{budget}s"] if timed else ["--spp", str(spp)]
                        rest = stop + ["--seed", str(seed + 1)]
                        picture, facts, seconds = run(scene, flags + extra + rest, without)
                        error = relmse(picture, converged)
                        low, high = facts["error"]["interval"] or (None, None)
                        return {
                            "study": study, "scene": name, "budget": budget, "spp": spp, "arm": arm, "seed": seed,
                            "relmse": max(error - left, 1e-9), "left": left, "seconds": seconds - loading,
                            "low": low, "high": high,
                        }

                    for row in pool.map(one, jobs):
                        log.write(json.dumps(row) + "\n")
                        log.flush()
    if not a.references_only:
        table(a.log)


def table(log):
    """The geometric means of the efficiency with a mechanism over that without, from all runs of `log`."""
    rows = [json.loads(line) for line in open(log)]
    key = lambda row: (row["study"], row["scene"], row["budget"], row["seed"])
    base = {key(row): row for row in rows if row["arm"] == "all"}
    holds = lambda row: row["low"] is not None and row["low"] <= row["relmse"] + row["left"] and row["relmse"] <= row["high"] + row["left"]
    for study in dict.fromkeys(row["study"] for row in rows):
        mine = [row for row in rows if row["study"] == study]
        scenes = list(dict.fromkeys(row["scene"] for row in mine))
        print(f"\n| {study} | " + " | ".join(scene.split("/")[-1] for scene in scenes) + " | mean | intervals |")
        print("|---" * (len(scenes) + 3) + "|")
        for arm in dict.fromkeys(row["arm"] for row in mine):
            if arm == "all":
                continue
            cells, every, kept = [], [], [0, 0, 0]
            for scene in scenes:
                logs = []
                for budget in sorted({row["budget"] for row in mine}):
                    pair = [(row, base[key(row)]) for row in mine
                            if (row["arm"], row["scene"], row["budget"]) == (arm, scene, budget) and key(row) in base]
                    if not pair:
                        continue
                    cost = lambda side: math.log(np.median([p[side]["relmse"] for p in pair])
                                                 * np.median([p[side]["seconds"] for p in pair]))
                    logs.append(cost(0) - cost(1))
                    kept = [kept[0] + sum(holds(p[1]) for p in pair), kept[1] + sum(holds(p[0]) for p in pair),
                            kept[2] + len(pair)]
                every += logs
                cells.append(" / ".join(f"{math.exp(x):.2f}" for x in logs) or "–")
            mean = math.exp(sum(every) / len(every)) if every else float("nan")
            print(f"| {arm} | " + " | ".join(cells) + f" | **{mean:.2f}** | {kept[0]} → {kept[1]} of {kept[2]} |")


if __name__ == "__main__":
    main()
