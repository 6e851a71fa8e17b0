"""The ground on which the comparisons stand: the virtual environment with Mitsuba, and our own program.

Importing this module first is enough: a script that does so runs inside `tests/peers/venv`, which is made
on the first run from `requirements.txt`.
"""

import datetime
import json
import os
import subprocess
import sys
import tempfile
import venv
from pathlib import Path

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent.parent
VENV = HERE / "venv"
OUTPUT = ROOT / "tests" / "output" / "peers"
THREADS = 2


def _enter_environment():
    python = VENV / "bin" / "python"
    if Path(sys.prefix).resolve() == VENV.resolve():
        return
    wanted = (HERE / "requirements.txt").read_text()
    stamp = VENV / "installed.txt"
    if not stamp.exists() or stamp.read_text() != wanted:
        print(f"making {VENV}", file=sys.stderr)
        venv.create(VENV, with_pip=True, clear=True)
        requirements = str(HERE / "requirements.txt")
        subprocess.check_call([python, "-m", "pip", "install", "--quiet", "-r", requirements])
        stamp.write_text(wanted)
    os.execv(python, [str(python), *sys.argv])


_enter_environment()

import drjit as dr  # noqa: E402  (only there inside the environment)
import mitsuba as mi  # noqa: E402
import numpy as np  # noqa: E402


def _choose_variant():
    """The fast variant needs LLVM as a shared library (Debian: `apt-get install libllvm15`)."""
    try:
        mi.set_variant("llvm_ad_rgb")
        dr.eval(mi.Float([1.0, 2.0]) + 1.0)
        dr.set_thread_count(THREADS)
    except Exception as reason:  # drjit raises plain RuntimeError or ImportError here
        print(f"no LLVM ({reason}): falling back to scalar_rgb; do not compare speeds", file=sys.stderr)
        mi.set_variant("scalar_rgb")


_choose_variant()
# The log would otherwise hold a line for each texture that is not a power of two.
mi.set_log_level(mi.LogLevel.Error)


def halflight_program():
    """Path of our program: `HALFLIGHT`, or a release build of this repository."""
    chosen = os.environ.get("HALFLIGHT")
    if chosen:
        return chosen
    subprocess.check_call(["cargo", "build", "--release", "--quiet", "-p", "halflight"], cwd=ROOT)
    target = Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target"))
    return str(target / "release" / "halflight")


def halflight(program, scene, spp, seed, size=None, extra=()):
    """Renders `scene` (a path) with our path tracer: the picture (height, width, 3) and the `--json` object."""
    with tempfile.TemporaryDirectory() as folder:
        picture = Path(folder) / "picture.exr"
        command = [program, "render", "--reconstruct", "off", str(scene), "-o", str(picture), "--method", "path", "--spp", str(spp)]
        command += ["--seed", str(seed), "--threads", str(THREADS), "--json"]
        if size:
            command += ["--size", f"{size[0]}x{size[1]}"]
        done = subprocess.run(command + list(extra), capture_output=True, text=True)
        if done.returncode != 0:
            raise RuntimeError(f"{' '.join(command)}\n{done.stderr}")
        return read_picture(picture), json.loads(done.stdout)


def read_picture(path):
    """Linear RGB of a picture file as a float64 array (height, width, 3)."""
    bitmap = mi.Bitmap(str(path)).convert(mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.Float32, False)
    return np.array(bitmap).astype(np.float64)


def write_picture(path, picture):
    """Writes a float array (height, width, 3) as OpenEXR (linear) or PNG (clamped, sRGB curve)."""
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    bitmap = mi.Bitmap(np.ascontiguousarray(picture, dtype=np.float32))
    if path.suffix == ".png":
        bitmap = bitmap.convert(mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.UInt8, True)
    bitmap.write(str(path))


def machine():
    """Date and processor, for the record."""
    lines = Path("/proc/cpuinfo").read_text().splitlines() if Path("/proc/cpuinfo").exists() else []
    model = next((line.split(":")[1].strip() for line in lines if line.startswith("model name")), "unknown processor")
    return f"{datetime.date.today()}, {model}, {THREADS} threads, Mitsuba {mi.__version__}"
