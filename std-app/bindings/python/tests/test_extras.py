"""Optional parts: skies and scenes of Radiance beside Radiance itself, denoised pictures beside references."""

import subprocess
from datetime import datetime

import numpy as np
import pytest
from conftest import CORNELL

import halflight_render as hl

NOON = datetime(2026, 6, 21, 12)
PLACE = {"latitude": 47, "longitude": -8, "timezone": -15, "year": 2026}

#: Sky and ground as the light of the brightness function.
DOME = """
skyfunc glow dome 0 0 4 1 1 1 0
dome source sky 0 0 4 0 0 1 180
dome source earth 0 0 4 0 0 -1 180
"""

ROOM = """
void plastic white 0 0 5 .7 .7 .7 0 0
void plastic floor 0 0 5 .2 .2 .2 0 0
void glass clear 0 0 3 .96 .96 .96
floor polygon ground 0 0 12  0 0 0  4 0 0  4 6 0  0 6 0
white polygon ceiling 0 0 12  0 0 3  0 6 3  4 6 3  4 0 3
white polygon west 0 0 12  0 0 0  0 6 0  0 6 3  0 0 3
white polygon east 0 0 12  4 0 0  4 0 3  4 6 3  4 6 0
white polygon north 0 0 12  0 6 0  4 6 0  4 6 3  0 6 3
white polygon south 0 0 30  0 0 0  0 0 3  4 0 3  4 0 0  .5 0 0  .5 0 .9  3.5 0 .9  3.5 0 2.4  .5 0 2.4  .5 0 0
clear polygon window 0 0 12  .5 0 .9  3.5 0 .9  3.5 0 2.4  .5 0 2.4
!genbox white box .5 .5 .5 | xform -t 1 3 0
white sphere ball 0 0 4  3 4 .5 .5
white cylinder post 0 0 7  3.5 5.5 0  3.5 5.5 2  .1
white ring plate 0 0 8  2 5 1.5  0 0 1  0 .3
"""


def measured(radiance, described, points, normals, bounces, folder):
    """Irradiance by rtrace."""
    octree = folder / "peer.oct"
    octree.write_bytes(radiance.oconv(stdin=described.encode()))
    rays = np.hstack([points, normals]).astype(np.float32).tobytes()
    # Without its cache, and with all paths of weight above 1e-6: errors are noise alone.
    params = ["-ab", str(bounces), "-ad", "1024", "-as", "0", "-aa", "0", "-lr", "12", "-lw", "1e-6", "-dt", "0", "-dc", "1"]
    found = radiance.rtrace(
        rays, str(octree), header=False, inform="f", outform="f", irradiance=True, params=params
    )
    return np.frombuffer(found, np.float32).reshape(-1, 3)


@pytest.mark.parametrize("kind", ["gendaylit", "gensky"])
def test_skies_light_a_field_as_in_radiance(kind, tmp_path):
    radiance = pytest.importorskip("pyradiance")
    from halflight_render import daylight

    keywords = {"dirnorm": 800, "diffhor": 120} if kind == "gendaylit" else {"sunny_with_sun": True}
    described = getattr(radiance, kind)(NOON, **PLACE, **keywords).decode()
    sky = daylight.sky(described)
    normals = np.array([[0, 0, 1], [0, -1, 0], [1, 0, 0.5], [0, 1, 0.2]], float)
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    points = np.zeros_like(normals)
    far = "void plastic grey 0 0 5 .2 .2 .2 0 0\ngrey polygon far 0 0 9 0 0 -900 1 0 -900 0 1 -900\n"
    (tmp_path / "none.rad").write_text(far)
    field = daylight.scene([tmp_path / "none.rad"], sky=sky)
    found = field.irradiance(points, normals, spp=4096).rgb
    peer = measured(radiance, described + DOME, points, normals, 1, tmp_path)
    # 1024 rays of the peer in a sky whose brightest part is 30 times its mean.
    assert found == pytest.approx(peer, rel=0.03)


def test_a_room_has_the_daylight_of_radiance(tmp_path):
    radiance = pytest.importorskip("pyradiance")
    from halflight_render import daylight

    described = radiance.gendaylit(NOON, **PLACE, dirnorm=800, diffhor=120).decode()
    (tmp_path / "room.rad").write_text(ROOM)
    room = daylight.scene([tmp_path / "room.rad"], sky=daylight.sky(described))
    x, y = np.meshgrid(np.linspace(0.5, 3.5, 3), np.linspace(1.0, 5.0, 4))
    points = np.column_stack([x.ravel(), y.ravel(), np.full(x.size, 1.2)])
    up = np.tile([0.0, 0, 1], (len(points), 1))
    found = room.irradiance(points, up, spp=4096)
    expanded = subprocess.run(
        [f"{radiance.BINPATH}/xform", "-e", "room.rad"], cwd=tmp_path, capture_output=True, check=True
    ).stdout.decode()
    peer = measured(radiance, described + DOME + expanded, points, up, 8, tmp_path)
    ratio = found.rgb.sum(axis=1) / peer.sum(axis=1)
    assert np.median(ratio) == pytest.approx(1, abs=0.05), ratio
    assert (np.abs(ratio - 1) < 0.15).mean() >= 0.9, ratio


def test_unknown_materials_and_shapes_are_refused(tmp_path):
    pytest.importorskip("pyradiance")
    from halflight_render import daylight

    for text, problem in (
        ("void trans t 0 0 7 1 1 1 0 0 1 0\nt polygon p 0 0 9 0 0 0 1 0 0 0 1 0\n", "`trans`"),
        ("wood polygon p 0 0 9 0 0 0 1 0 0 0 1 0\n", "no material `wood`"),
        ("!no-such-program\n", "no-such-program"),
    ):
        (tmp_path / "a.rad").write_text(text)
        with pytest.raises(hl.SceneError, match=problem):
            daylight.scene([tmp_path / "a.rad"])


def smoothed(image):
    """A mean of 5 × 5 pixels: a denoiser with much bias at edges."""
    padded = np.pad(image, ((2, 2), (2, 2), (0, 0)), "edge")
    rows, columns, _ = image.shape
    parts = [padded[i : i + rows, j : j + columns] for i in range(5) for j in range(5)]
    return np.mean(parts, axis=0, dtype=np.float64).astype(np.float32)


def denoisers():
    yield smoothed
    try:
        import pyoidn  # noqa: F401
    except ImportError:
        return
    from halflight_render.denoising import oidn

    yield oidn


@pytest.mark.parametrize("denoiser", list(denoisers()), ids=lambda denoiser: denoiser.__name__)
def test_the_error_of_a_denoised_picture_is_estimated_without_a_reference(denoiser):
    from halflight_render.denoising import denoise

    scene = hl.open(CORNELL)
    settings = {"size": (64, 64), "method": "path", "reconstruct": False, "caustics": False, "layers": ["halves"]}
    reference = scene.render(spp=512, seed=99, **settings)
    ratios, known = [], []
    for seed in range(6):
        found = denoise(*(scene.render(spp=16, seed=2 * seed + i, **settings) for i in (0, 1)), denoiser=denoiser)
        true = hl.compare(found.image, reference).relmse
        ratios.append(found.relmse / true)
        known.append(found.known)
        assert found.interval[0] < found.relmse < found.interval[1]
    # The noise of the reference and the weight, which is of the denoised picture, are a tenth.
    assert np.abs(np.log(ratios)).max() < np.log(1.3) and np.median(ratios) == pytest.approx(1, abs=0.15), ratios
    # The error of a mean of 5 × 5 pixels lies in few pixels, at edges, where their number does not suffice.
    assert all(known) or denoiser is smoothed


def test_an_error_that_cannot_be_known_is_said_to_be_unknown():
    from halflight_render.denoising import denoise

    scene = hl.open(CORNELL)
    settings = {"method": "path", "reconstruct": False, "layers": ["halves"]}
    # 256 pixels of four samples.
    few = denoise(*(scene.render(spp=4, size=(16, 16), seed=i, **settings) for i in (0, 1)), denoiser=smoothed)
    assert not few.known and few.interval[1] > 1.3 * few.relmse
    halves = denoise(scene.render(spp=64, size=(64, 64), **settings), denoiser=smoothed)
    assert not halves.known and halves.interval[0] == 0


def test_a_planted_blur_is_found():
    from halflight_render.denoising import denoise

    scene = hl.open(CORNELL)
    settings = {"size": (96, 96), "method": "path", "reconstruct": False, "spp": 16}
    pair = [scene.render(seed=seed, **settings) for seed in (0, 1)]

    def planted(image):
        better = image.copy()
        better[32:48, 48:64] = better[32:48, 48:64].mean(axis=(0, 1)) * 1.5
        return better

    found = denoise(*pair, denoiser=planted)
    excess = (found.blocks - found.noisy_blocks) / found.block_errors
    assert found.worse[2, 3] and np.unravel_index(excess.argmax(), excess.shape) == (2, 3)
    for refused in ((pair[0], pair[0]), (pair[0], scene.render(**(settings | {"spp": 2})))):
        with pytest.raises(hl.Error):
            denoise(*refused)


def test_the_halves_of_one_picture_limit_its_error():
    from halflight_render.denoising import denoise

    scene = hl.open(CORNELL)
    settings = {"size": (64, 64), "method": "path", "reconstruct": False, "caustics": False, "layers": ["halves"]}
    reference = scene.render(spp=512, seed=99, **settings)
    picture = scene.render(spp=32, **settings)
    found = denoise(picture, denoiser=smoothed)
    half = np.mean([hl.compare(smoothed(image), reference).relmse for image in picture.halves])
    assert found.relmse == pytest.approx(half, rel=0.3)
    assert found.interval[0] == 0 and found.interval[1] > hl.compare(found.image, reference).relmse
    with pytest.raises(hl.SettingsError, match="layers=.'halves'"):
        denoise(scene.render(spp=16, size=(16, 16), method="path", reconstruct=False))


def test_a_filter_that_lies_about_halves_is_found_out():
    from halflight_render.denoising import denoise

    scene = hl.open(CORNELL)
    settings = {"size": (48, 48), "method": "path", "reconstruct": False, "spp": 16, "layers": ["halves"]}
    pair = [scene.render(seed=seed, **settings) for seed in (0, 1)]
    mean = (pair[0].image.astype(np.float64) + pair[1].image) / 2

    def lying(image):
        return 2 * image if np.allclose(image, mean, rtol=1e-4) else image

    honest, found = denoise(*pair, denoiser=lambda image: image), denoise(*pair, denoiser=lying)
    # The picture of both is twice as bright as the scene: its relMSE is about 1.
    assert honest.relmse < 0.1 and found.relmse > 0.5


def test_the_grid_of_an_octree_is_that_of_its_files(tmp_path):
    radiance = pytest.importorskip("pyradiance")
    from halflight_render import daylight

    described = radiance.gendaylit(NOON, **PLACE, dirnorm=800, diffhor=120).decode()
    glow = "skyfunc glow glow 0 0 4 1 1 1 0\nglow source sky 0 0 4 0 0 1 180\nglow source earth 0 0 4 0 0 -1 180\n"
    (tmp_path / "clear.sky").write_text(described + glow)
    (tmp_path / "room.rad").write_text(ROOM)
    (tmp_path / "desk.pts").write_text("1 2 1.2 0 0 1\n2 4 1.2 0 0 1\n")
    with open(tmp_path / "scene.oct", "wb") as octree:
        subprocess.run([f"{radiance.BINPATH}/oconv", "clear.sky", "room.rad"], cwd=tmp_path, stdout=octree, check=True)
    output = tmp_path / "desk.res"
    values, found = daylight.point_in_time(tmp_path / "scene.oct", tmp_path / "desk.pts", spp=64, output=output)
    room = daylight.scene([tmp_path / "room.rad"], sky=daylight.sky(described))
    same = room.irradiance([[1, 2, 1.2], [2, 4, 1.2]], (0, 0, 1), spp=64)
    assert found.rgb == pytest.approx(same.rgb, rel=1e-3) and (values > 10).all()
    assert values == pytest.approx(same.rgb @ [0.265, 0.67, 0.065] * 179, rel=1e-3)
    assert np.loadtxt(output) == pytest.approx(values, rel=1e-6)
    with pytest.raises(hl.SceneError, match="no octree"):
        daylight.of_octree(tmp_path / "room.rad")
