"""Do renders that stop by `--error` have that error? Of the published scenes, 40 renders each.

    python3 tests/peers/stopping.py [--size 128] [--error 0.001] [--renders 40] [--times 100] [scene ...]

The scenes live outside of this repository (`HALFLIGHT_SCENES`). Writes them as scene files and has the example
`calibration` of the crate `halflight-tests` do the rest; it prints the tables of docs/validation.md.
"""

import argparse
import subprocess
import sys
import tempfile
from pathlib import Path

import workbench
from published import SCENES, published
from scene_file import write_scene

CASES = [
    "cornell-box-bitterli",
    "cbox-mitsuba",
    "CornellBox-Original",
    "CornellBox-Empty-White",
    "CornellBox-Glossy",
    "material-testball",
]


def description(name, size):
    if not name.startswith("CornellBox"):
        return published(name, size)
    # The files of the McGuire archive come without a camera.
    camera = {"eye": [0.0, 0.9, 2.5], "look_at": [0.0, 0.9, 1.5], "up": [0.0, 1.0, 0.0], "fov": 60.0}
    mesh = [{"file": str(SCENES / "cornell-mcguire" / f"{name}.obj")}]
    return {"render": {"size": list(size)}, "mesh": mesh, "camera": camera}


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--size", type=int, default=128)
    for flag, value in [("--error", "0.001"), ("--renders", "40"), ("--times", "100")]:
        parser.add_argument(flag, default=value)
    parser.add_argument("scenes", nargs="*", default=CASES)
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        files = []
        for name in arguments.scenes:
            files.append(Path(folder) / f"{name}.toml")
            write_scene(files[-1], description(name, (arguments.size, arguments.size)))
        flags = []
        for name in ("size", "error", "renders", "times"):
            flags += [f"--{name}", str(getattr(arguments, name))]
        command = ["cargo", "run", "--release", "-p", "halflight-tests", "--example", "calibration", "--"]
        sys.exit(subprocess.call([*command, *flags, *files], cwd=workbench.ROOT))


if __name__ == "__main__":
    main()
