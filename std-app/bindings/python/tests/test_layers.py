"""Layers of pictures as arrays, their files, and the recipe of the guide that collects them."""

import numpy as np
import pytest
from conftest import CORNELL, ROOT, SQUARE, TRIANGLES

import halflight_render as hl

FAST = {"spp": 8, "size": (48, 32), "method": "path"}


def test_layers_of_a_floor_are_those_of_geometry():
    floor = hl.Mesh(SQUARE, TRIANGLES, hl.diffuse((0.2, 0.4, 0.6)), name="floor")
    scene = hl.Scene([floor], environment=1.0, camera=hl.Camera(eye=(0, 2, 0), look_at=(0, 0, 0), up=(0, 0, -1), fov=30))
    picture = scene.render(spp=4, size=(8, 8), layers="all")
    assert picture.albedo == pytest.approx(np.broadcast_to((0.2, 0.4, 0.6), (8, 8, 3)), abs=1e-6)
    assert picture.normal == pytest.approx(np.broadcast_to((0, 1, 0), (8, 8, 3)), abs=1e-6)
    # A pixel at the tangent x of the angle from the axis sees the floor at the distance 2 sqrt(1 + x²).
    x, y = np.meshgrid(*[(np.arange(8) - 3.5) / 4 * np.tan(np.radians(15))] * 2)
    assert picture.depth == pytest.approx(2 * np.sqrt(1 + x**2 + y**2), rel=1e-3)
    assert picture.position == pytest.approx(np.stack([2 * x, 0 * x, 2 * y], axis=2), abs=0.05)
    assert (picture.material == 0).all() and (picture.object == 0).all()
    assert (scene.materials, scene.objects) == (["material 0"], ["floor"])
    assert np.array_equal(picture.error, np.sqrt(picture.variance))


def test_the_sky_is_nothing(floor):
    picture = floor.render(spp=4, size=(8, 8), eye=(0, 1, 0), look_at=(0, 2, 0.1), layers=["depth", "object"])
    assert not picture.depth.any() and (picture.object == -1).all()


def test_halves_are_independent_and_have_the_picture_as_mean(cornell):
    picture = cornell.render(layers=["halves"], reconstruct=False, **FAST)
    even, odd = picture.halves
    assert (even + odd) / 2 == pytest.approx(picture.image, rel=1e-4, abs=1e-6)
    assert picture.variance == pytest.approx(((even - odd) / 2) ** 2, rel=1e-2, abs=1e-6)


def test_layers_do_not_change_the_picture_and_are_named_when_missing(cornell):
    plain, layered = cornell.render(**FAST), cornell.render(layers="albedo,depth", **FAST)
    assert np.array_equal(plain.image, layered.image)
    for picture in (plain, layered):
        with pytest.raises(hl.SettingsError, match="layers=.'normal'"):
            picture.normal  # noqa: B018
    with pytest.raises(hl.SettingsError, match="expected one of albedo"):
        cornell.render(layers=["albedos"], **FAST)


def test_exr_files_have_layers_and_facts(cornell, tmp_path):
    picture = cornell.render(layers=["depth", "samples"], seed=3, **FAST)
    picture.save(tmp_path / "a.exr")
    assert np.array_equal(hl.read_image(tmp_path / "a.exr"), picture.image)
    written = (tmp_path / "a.exr").read_bytes()
    assert all(name in written for name in (b"depth.Z", b"samples.X", b"relMSEInterval", b"seed"))


def test_reports_have_the_views_of_photons(cornell, tmp_path):
    settings = {"spp": 4, "size": (32, 32), "method": "photon-map", "global_photons": 10_000}
    cornell.render(report=tmp_path / "with", **settings)
    cornell.render(**settings).report(tmp_path / "without")
    with_views, without = ((tmp_path / name / "index.html").read_text() for name in ("with", "without"))
    assert "photon_density" in with_views and "photon_density" not in without
    (tmp_path / "file").write_text("")
    with pytest.raises(hl.FileError, match="a file, not a folder"):
        cornell.render(report=tmp_path / "file", **settings)


def test_the_recipe_of_the_guide_runs(tmp_path, monkeypatch):
    guide = (ROOT / "docs" / "python.md").read_text()
    section = guide.split("## Synthetic data\n", 1)[1].split("\n## ", 1)[0]
    code = "\n".join(line[4:] for line in section.splitlines() if line.startswith("    ") or not line)
    assert sum(bool(line.strip()) for line in code.splitlines()) <= 20
    for given, small in (('"room.glb"', repr(str(CORNELL))), ("range(100)", "range(2)"), ("(320, 240)", "(24, 16)")):
        assert given in code
        code = code.replace(given, small)
    monkeypatch.chdir(tmp_path)
    exec(compile(code, "docs/python.md", "exec"), {})
    views = [np.load(tmp_path / f"view-{view:04}.npz") for view in range(2)]
    for view in views:
        assert view["image"].shape == view["albedo"].shape == view["error"].shape == (16, 24, 3)
        assert view["depth"].shape == view["object"].shape == view["samples"].shape == (16, 24)
        seen = view["image"].max(axis=2) > 0
        assert seen.mean() > 0.3 and (view["error"].max(axis=2)[seen] > 0).mean() > 0.9 and view["depth"].max() > 0
    assert not np.array_equal(views[0]["depth"], views[1]["depth"])
