"""Settings, errors, interruptions, threads, and memory."""

import os
import re
import signal
import subprocess
import sys
import threading
import typing
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
from conftest import ROOT, sky_floor

import halflight_render as hl
from halflight_render import _settings

TINY = {"spp": 4, "size": (16, 16), "method": "path"}


def test_typed_settings_are_those_of_the_program():
    typed = set(typing.get_type_hints(_settings.Settings, localns={"Camera": hl.Camera}))
    assert typed == set(hl.settings())
    flags = set(re.findall(r"--([a-z][a-z-]+)", (ROOT / "docs" / "cli.md").read_text()))
    renamed = {name: flag for name, flag in _settings.RENAMED.items()}
    for name in set(hl.settings()) - set(_settings.OWN):
        assert renamed.get(name, name).replace("_", "-") in flags, name


@pytest.mark.parametrize(
    ("name", "value", "hint"),
    [
        ("second", 1, "did you mean `seconds`?"),
        ("time", 1, "did you mean `seconds`?"),
        ("cach_error", 1, "did you mean `cache_error`?"),
        ("samples", 1, "did you mean `spp`?"),
        ("xyzzy", 1, "the settings are "),
    ],
)
def test_settings_that_do_not_exist_are_refused_with_the_nearest(floor, name, value, hint):
    with pytest.raises(hl.SettingsError, match=f"there is no setting `{name}`") as refused:
        floor.render(**{name: value})
    assert hint in str(refused.value)


def test_other_work_refuses_unknown_settings_too(floor):
    with pytest.raises(hl.SettingsError, match="there is no setting `errors`\n.*did you mean `error`"):
        floor.irradiance([[0, 1, 0]], (0, 1, 0), errors=0.1)
    with pytest.raises(hl.SettingsError, match="did you mean `spp`"):
        floor.bake_lightmap((8, 8), samples=4)


@pytest.mark.parametrize(
    ("settings", "problem"),
    [
        ({"spp": 0}, "spp=0: samples per pixel"),
        ({"error": -1}, "error=-1: an error to stop at"),
        ({"method": "paths"}, "method=paths: expected one of auto, path"),
        ({"size": (0, 4)}, "size=0x4: width and height"),
        ({"fov": 200}, "fov=200: a field of view"),
        ({"reuse": "maybe"}, "reuse=maybe: expected one of auto, on, off"),
        ({"eye": (0, 0, 0), "look_at": (0, 0, 0)}, "same point"),
        ({"camera": "north"}, "no camera `north`"),
        ({"shard": "1/2", "spp": 4}, "checkpoint"),
    ],
)
def test_senseless_values_are_refused(floor, settings, problem):
    with pytest.raises(hl.SettingsError) as refused:
        floor.render(**settings)
    assert problem in str(refused.value)


def test_values_of_python_are_those_of_flags(floor):
    plain = floor.render(**TINY).image
    for same in (
        {"size": np.array([16, 16]), "spp": np.int64(4)},
        {"size": "16x16", "seed": 0, "max_depth": None},
        {"caustics": True, "reuse": "auto", "reconstruct": True, "progress": False},
        {"threads": 1, "memory": "1G"},
    ):
        assert np.array_equal(floor.render(**(TINY | same)).image, plain), same
    assert floor.render(precise=True, **TINY).info["level"] == "baseline"
    assert floor.render(precise=False, **TINY).info["level"] != ""


def test_errors_name_the_file_the_line_and_the_remedy(tmp_path):
    (tmp_path / "a.toml").write_text('[[mesh]]\nfile = "a.obj"\nfil = 3\n')
    with pytest.raises(hl.SceneError) as refused:
        hl.open(tmp_path / "a.toml")
    error = refused.value
    assert error.file == str(tmp_path / "a.toml") and error.line == 3
    assert isinstance(error, ValueError) and isinstance(error, hl.Error)
    with pytest.raises(OSError) as missing:
        hl.open(tmp_path / "none.obj")
    assert isinstance(missing.value, hl.FileError) and "none.obj" in str(missing.value)
    assert missing.value.help
    with pytest.raises(hl.FileError, match="its folder does not exist"):
        sky_floor().render(**TINY).save(tmp_path / "none" / "a.png")
    with pytest.raises(MemoryError):
        hl.open(ROOT / "scenes" / "cornell" / "cornell.obj").render(memory=1000, **TINY)


def test_ctrl_c_raises_with_the_picture(floor):
    threading.Timer(0.3, os.kill, (os.getpid(), signal.SIGINT)).start()
    with pytest.raises(KeyboardInterrupt) as ended:
        floor.render(spp=1 << 28, size=(64, 64), method="path")
    picture = ended.value.picture
    assert picture.ending == "interrupted" and picture.image.max() > 0 and picture.spp < 1 << 28


def test_callbacks_see_the_progress_and_their_exceptions_pass(cornell):
    seen = []

    def callback(progress):
        seen.append((progress.spp, progress.picture, progress))

    picture = cornell.render(progress=callback, reconstruct=False, **(TINY | {"spp": 16}))
    assert [spp for spp, _, _ in seen] == sorted(spp for spp, _, _ in seen)
    assert seen[-1][0] == 16 and np.array_equal(seen[-1][1], picture.image)
    with pytest.raises(hl.Error, match="during the callback"):
        _ = seen[-1][2].picture

    class Enough(Exception):
        pass

    def stop(progress):
        raise Enough(progress.spp)

    with pytest.raises(Enough):
        cornell.render(progress=stop, **(TINY | {"spp": 1 << 20}))


def test_points_have_progress_as_well(floor):
    seen = []
    floor.irradiance([[0, 0.1, 0]], (0, 1, 0), spp=64, progress=lambda progress: seen.append(progress.tiles))
    assert seen and seen[-1][0] >= 1


def test_two_threads_render_at_once(cornell):
    alone = cornell.render(**TINY).image
    barrier = threading.Barrier(2, timeout=60)
    waited = []

    def meet(progress):
        # Both renders are in progress here.
        if threading.get_ident() not in waited:
            waited.append(threading.get_ident())
            barrier.wait()

    with ThreadPoolExecutor(2) as pool:
        jobs = [pool.submit(cornell.render, progress=meet, **TINY) for _ in range(2)]
        assert all(np.array_equal(job.result().image, alone) for job in jobs)


def resident():
    text = open("/proc/self/status").read()
    return int(re.search(r"VmRSS:\s+(\d+) kB", text).group(1)) / 1024


@pytest.mark.skipif(not os.path.exists("/proc/self/status"), reason="there is no /proc")
def test_a_thousand_renders_leave_no_memory_behind(floor):
    settings = {"spp": 1, "size": (8, 8), "method": "path"}
    for _ in range(200):
        floor.render(**settings)
    before = resident()
    for _ in range(1000):
        floor.render(**settings)
    assert resident() - before < 5


@pytest.mark.skipif(not hasattr(os, "fork"), reason="there is no fork")
def test_a_scene_of_before_a_fork_is_refused(tmp_path):
    code = (
        "import os, halflight_render as hl\n"
        "scene = hl.Scene([], environment=1.0)\n"
        "if os.fork() == 0:\n"
        "    try: scene.render(spp=1, size=(4, 4))\n"
        "    except RuntimeError as error: os._exit(0 if 'fork' in str(error) else 1)\n"
        "    os._exit(2)\n"
        "assert os.wait()[1] == 0\n"
    )
    done = subprocess.run([sys.executable, "-W", "ignore", "-c", code], timeout=60, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


def test_terminals_show_the_progress():
    import pty

    read, write = pty.openpty()
    code = (
        "import halflight_render as hl\n"
        "scene = hl.Scene([], environment=1.0)\n"
        "scene.render(seconds=1.5, size=(64, 64), method='path')\n"
    )
    done = subprocess.Popen([sys.executable, "-c", code], stderr=write)
    assert done.wait(timeout=60) == 0
    os.close(write)
    shown = os.read(read, 1 << 16).decode()
    assert " spp" in shown and "%" in shown
