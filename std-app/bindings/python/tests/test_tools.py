"""Nearest points, eigen decompositions, comparison of pictures, and types."""

import subprocess
import sys

import numpy as np
import pytest

import halflight_render as hl


def test_nearest_points_are_those_of_brute_force():
    generator = np.random.default_rng(3)
    positions = generator.normal(size=(2000, 3)).astype(np.float32)
    places = generator.normal(size=(100, 3)).astype(np.float32)
    distances = np.linalg.norm(places[:, None].astype(float) - positions[None].astype(float), axis=2)
    photons = hl.Photons(positions)
    assert len(photons) == 2000
    indices, found = photons.nearest(places, 7)
    assert found == pytest.approx(np.sort(distances, axis=1)[:, :7], rel=1e-5)
    assert np.take_along_axis(distances, indices, 1) == pytest.approx(found, rel=1e-5)
    indices, found = photons.nearest(places, 7, radius=0.2)
    counts = np.minimum((distances < 0.2).sum(axis=1), 7)
    assert ((indices >= 0).sum(axis=1) == counts).all() and np.isinf(found[indices < 0]).all()
    assert hl.Photons(np.zeros((0, 3))).nearest(places, 3)[0].shape == (100, 0)
    with pytest.raises(hl.Error):
        photons.nearest(places, 0)


@pytest.mark.parametrize("size", [2, 3])
def test_eigen_decompositions_make_the_matrix(size):
    generator = np.random.default_rng(4)
    matrices = generator.normal(size=(33, size, size))
    matrices += matrices.transpose(0, 2, 1)
    found = hl.eigen(matrices)
    assert (np.abs(found.values[:, :-1]) >= np.abs(found.values[:, 1:])).all()
    made = np.einsum("nk,nki,nkj->nij", found.values, found.vectors, found.vectors)
    assert made == pytest.approx(matrices, abs=1e-5)
    expected = np.sort(np.linalg.eigvalsh(matrices), axis=1)
    assert np.sort(found.values, axis=1) == pytest.approx(expected, abs=1e-5)
    with pytest.raises(hl.Error):
        hl.eigen(np.zeros((3, 4, 4)))


def test_comparisons_are_those_of_their_formulas():
    generator = np.random.default_rng(5)
    reference = generator.uniform(0, 1, (20, 30, 3))
    image = reference + generator.normal(scale=0.05, size=reference.shape)
    found = hl.compare(image, reference)
    mse = np.mean((image - reference) ** 2)
    floor = 0.01 * reference.mean() ** 2
    assert found.mse == pytest.approx(mse, rel=1e-4)
    assert found.rmse == pytest.approx(mse**0.5, rel=1e-4)
    assert found.relmse == pytest.approx(np.mean((image - reference) ** 2 / (reference**2 + floor)), rel=1e-3)
    map_ = hl.flip(image, reference)
    assert map_.shape == (20, 30) and map_.mean() == pytest.approx(found.flip, rel=1e-6)
    assert hl.compare(reference, reference).flip == 0
    with pytest.raises(hl.Error, match="differ in size"):
        hl.compare(image[:10], reference)
    with pytest.raises(hl.Error, match=r"\(rows, columns, 3\)"):
        hl.flip(image[..., 0], reference[..., 0])


def test_one_origin_or_direction_serves_all_rays(cornell):
    low, high = np.array(cornell.bounds)
    center, ways = (low + high) / 2, np.random.default_rng(0).normal(size=(20, 3))
    hits = cornell.trace(center, ways)
    assert np.array_equal(hits.t, cornell.trace(np.tile(center, (20, 1)), ways).t)
    assert repr(hits).startswith("<Hits of 20 rays, ")
    assert len(cornell.trace(np.tile(center, (3, 1)), (0, -1, 0))) == 3
    assert cornell.occluded(center, ways).shape == (20,)
    with pytest.raises(hl.SettingsError, match="directions have the shape"):
        cornell.trace(center, ways[:, :2])
    with pytest.raises(hl.SettingsError, match=r"reshape\(-1, 3\)"):
        cornell.irradiance(np.zeros((2, 2, 3)), (0, 1, 0))
    assert "points, mean" in repr(cornell.irradiance([center], (0, 1, 0), spp=4))


def test_types_are_strict(tmp_path):
    pytest.importorskip("mypy")
    use = tmp_path / "use.py"
    use.write_text(
        "import numpy as np\nimport halflight_render as hl\n"
        'picture = hl.open("a.obj").render(spp=4, size=(8, 8), camera=hl.Camera(eye=(0, 1, 2)))\n'
        "value: float | None = picture.relmse\n"
        "image = picture.image + np.float32(1)\n"
    )
    words = [sys.executable, "-m", "mypy", "--strict", "--ignore-missing-imports", "--cache-dir", str(tmp_path)]
    for checked in (["-p", "halflight_render"], [str(use)]):
        done = subprocess.run([*words, *checked], capture_output=True, text=True, cwd=tmp_path)
        assert done.returncode == 0, done.stdout
    use.write_text('import halflight_render as hl\nhl.open("a.obj").render(spq=4)\n')
    done = subprocess.run([*words, str(use)], capture_output=True, text=True, cwd=tmp_path)
    assert "spq" in done.stdout
