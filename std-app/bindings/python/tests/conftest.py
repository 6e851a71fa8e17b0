"""Scenes of the tests."""

from pathlib import Path

import numpy as np
import pytest

import halflight_render as hl

ROOT = Path(__file__).resolve().parents[4]
CORNELL = ROOT / "scenes" / "cornell" / "cornell.obj"

#: A square of two triangles in y = 0 that faces up.
SQUARE = np.array([[-1.0, 0.0, -1.0], [-1.0, 0.0, 1.0], [1.0, 0.0, 1.0], [1.0, 0.0, -1.0]])
TRIANGLES = np.array([[0, 1, 2], [0, 2, 3]])


def sky_floor(reflectance=0.5):
    """A floor under a white sky, whose irradiance is pi."""
    floor = hl.Mesh(SQUARE, TRIANGLES, hl.diffuse(reflectance), name="floor")
    camera = hl.Camera(eye=(0, 2, 3), look_at=(0, 0, 0), fov=40)
    return hl.Scene([floor], environment=1.0, camera=camera)


@pytest.fixture(scope="session")
def cornell():
    return hl.open(CORNELL)


@pytest.fixture(scope="session")
def cornell_path():
    return CORNELL


@pytest.fixture()
def floor():
    return sky_floor()
