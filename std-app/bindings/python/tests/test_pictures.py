"""Pictures: their bits, arrays, errors, files, and what notebooks show of them."""

import json
import subprocess
import sys

import numpy as np
import pytest

import halflight_render as hl

FAST = {"spp": 8, "size": (48, 32), "method": "path"}


def program(*words):
    return subprocess.run(
        [sys.executable, "-m", "halflight_render", *map(str, words)], capture_output=True, text=True
    )


def test_bits_are_those_of_the_program(cornell, cornell_path, tmp_path):
    for method in ("path", "irradiance-cache", "vcm"):
        file = tmp_path / f"{method}.pfm"
        done = program(
            "render", cornell_path, "--spp", 8, "--size", "48x32", "--method", method, "-o", file, "--json",
            "--audit", "off",
        )
        assert done.returncode == 0, done.stderr
        # An audit takes a share of the time, which no two renders have in common.
        picture = cornell.render(spp=8, size=(48, 32), method=method, audit=False)
        assert np.array_equal(hl.read_image(file), picture.image)
        printed = json.loads(done.stdout)
        assert printed["error"]["relmse"] == pytest.approx(picture.relmse, rel=1e-12)
        assert printed["findings"].keys() == picture.findings.keys()


def test_arrays_have_the_shape_of_the_picture(cornell):
    picture = cornell.render(**FAST)
    assert picture.image.shape == picture.variance.shape == (32, 48, 3)
    assert picture.image.dtype == np.float32 and picture.image.flags.c_contiguous
    assert picture.samples.shape == (32, 48) and (picture.samples == 8).all()
    assert picture.image is picture.image or np.shares_memory(picture.image, picture.image)
    lower, upper = picture.interval
    assert lower <= picture.relmse <= upper
    assert (picture.spp, picture.method, picture.ending) == (8, "path", "done")


def test_arrays_outlive_their_picture_and_scene(floor):
    image = floor.render(**FAST).image
    mean = image.mean()
    del floor
    assert image.mean() == mean


def test_variance_is_that_of_seeds(cornell):
    pictures = [cornell.render(seed=seed, reconstruct=False, caustics=False, **FAST) for seed in range(24)]
    spread = np.var([picture.image for picture in pictures], axis=0, ddof=1).mean()
    expected = np.mean([picture.variance for picture in pictures])
    # The mean of 24 × 4608 variances; heavy tails leave a tenth of freedom.
    assert spread == pytest.approx(expected, rel=0.15)


def test_the_sky_lights_a_floor_as_theory_says(floor):
    picture = floor.render(spp=64, size=(32, 32), method="path")
    hits = floor.trace(np.tile([0.0, 2.0, 3.0], (1, 1)), [[0.0, -2.0, -3.0]])
    assert hits.hit.all()
    # Radiance of a diffuse surface of reflectance 0.5 below a sky of radiance 1.
    assert picture.image[16, 16] == pytest.approx(0.5, abs=0.02)


def test_views_share_a_build(cornell):
    cameras = [hl.Camera(eye=(0.1 * i, 1, 3.5), look_at=(0, 1, 0), fov=40) for i in range(3)]
    views = [cornell.render(camera=camera, **FAST) for camera in cameras]
    again = cornell.render(eye=(0.1, 1, 3.5), look_at=(0, 1, 0), fov=40, **FAST)
    assert np.array_equal(views[1].image, again.image)
    assert not np.array_equal(views[0].image, views[1].image)


def test_files_are_those_of_their_formats(cornell, tmp_path):
    picture = cornell.render(**FAST)
    for name in ("a.exr", "a.pfm"):
        picture.save(tmp_path / name)
        assert np.array_equal(hl.read_image(tmp_path / name), picture.image)
    picture.save(tmp_path / "a.png", exposure=1, view="agx")
    assert (tmp_path / "a.png").read_bytes() == picture.png(exposure=1, view="agx")
    assert picture.png() != picture.png(exposure="auto", view="neutral")
    hl.save_image(tmp_path / "b.exr", picture.image)
    assert np.array_equal(hl.read_image(tmp_path / "b.exr"), picture.image)
    picture.report(tmp_path / "report")
    run = json.loads((tmp_path / "report" / "run.json").read_text())
    assert run["error"]["relmse"] == pytest.approx(picture.relmse)
    assert (tmp_path / "report" / "index.html").stat().st_size > 10_000


def test_a_notebook_shows_the_picture_with_its_error(cornell):
    picture = cornell.render(**FAST)
    assert picture._repr_png_().startswith(b"\x89PNG")
    page = picture._repr_html_()
    assert "data:image/png;base64," in page and "relMSE" in page and "8 spp by path" in page
    assert "relMSE" in repr(picture)


def test_references_are_arrays_pictures_or_files(cornell, tmp_path):
    reference = cornell.render(**(FAST | {"spp": 32, "seed": 7}))
    reference.save(tmp_path / "r.exr")
    for given in (reference, reference.image, tmp_path / "r.exr"):
        info = cornell.render(reference=given, **FAST).info
        against = hl.compare(cornell.render(**FAST), reference)
        assert info["error"]["relmse"] == pytest.approx(against.relmse, rel=1e-6)


def test_checkpoints_continue(cornell, tmp_path):
    film = tmp_path / "a.film"
    cornell.render(checkpoint=film, **FAST)
    resumed = cornell.render(resume=film, **(FAST | {"spp": 16}))
    assert np.array_equal(resumed.image, cornell.render(**(FAST | {"spp": 16})).image)


def test_the_program_is_in_the_package(tmp_path):
    assert program("--version").stdout.startswith("halflight ")
    refused = program("render", tmp_path / "none.obj")
    assert refused.returncode == 2 and "none.obj" in refused.stderr
