"""Lightmaps: their values, errors, files and refusals."""

import numpy as np
import pytest
from conftest import SQUARE, TRIANGLES

import halflight_render as hl

#: Texture coordinates of the square, whose first corner is at the top left of a picture.
UV = np.array([[0.0, 1.0], [0.0, 0.0], [1.0, 0.0], [1.0, 1.0]])


def lit_floor(**keywords):
    floor = hl.Mesh(SQUARE, TRIANGLES, hl.diffuse(0.5), texcoords=UV, name="floor")
    return hl.Scene([floor], **keywords)


def test_a_floor_below_a_white_sky_receives_pi():
    baked = lit_floor(environment=1.0).bake_lightmap((8, 4), spp=64)
    assert baked.irradiance.shape == (4, 8, 3) and baked.error.shape == baked.coverage.shape == (4, 8)
    assert (baked.coverage == 2).all() and baked.charts == 1
    assert baked.irradiance == pytest.approx(np.pi, rel=0.02)


def test_texels_lie_where_their_texture_coordinates_are():
    light = hl.Point((-0.8, 0.3, -0.8), 1.0)
    baked = lit_floor(lights=[light]).bake_lightmap((16, 16), "floor", spp=16)
    row, column = np.unravel_index(baked.irradiance[..., 0].argmax(), (16, 16))
    # The corner (-1, 0, -1) has the first pixel of the first row; the light is a tenth of the side away.
    assert (row, column) == (1, 1)
    below = baked.at(np.array([[0.1, 0.9]]))[0, 0]
    # Intensity over the squared height, within the size of a texel.
    assert below == pytest.approx(1 / 0.3**2, rel=0.1)


def test_files_have_values_and_errors(tmp_path):
    baked = lit_floor(environment=1.0).bake_lightmap((8, 8), spp=16, supersample=2)
    baked.save(tmp_path / "map.exr")
    baked.save_error(tmp_path / "error.pfm")
    assert np.array_equal(hl.read_image(tmp_path / "map.exr"), baked.irradiance)
    assert np.array_equal(hl.read_image(tmp_path / "error.pfm")[..., 0], baked.error)
    with pytest.raises(hl.FileError, match="no room for light"):
        baked.save(tmp_path / "map.png")


def test_directional_maps_have_four_layers():
    baked = lit_floor(environment=1.0).bake_lightmap((4, 4), spp=64, directional=True)
    assert baked.irradiance.shape == (4, 4, 4, 3)
    up = baked.irradiance[0] + baked.irradiance[2]
    assert up == pytest.approx(np.pi, rel=0.1)


def test_refusals_name_their_reason(cornell):
    scene = lit_floor(environment=1.0)
    with pytest.raises(hl.SettingsError, match="the names are all, floor"):
        scene.bake_lightmap((8, 8), "roof", spp=4)
    with pytest.raises(hl.SettingsError, match="size=0"):
        scene.bake_lightmap((0, 8), spp=4)
    with pytest.raises(hl.SettingsError, match="charts=True"):
        cornell.bake_lightmap((8, 8), spp=4)
    bare = hl.Scene([hl.Mesh(SQUARE, TRIANGLES)], environment=1.0)
    with pytest.raises(hl.SettingsError, match="no texture coordinates"):
        bare.bake_lightmap((8, 8), spp=4)
