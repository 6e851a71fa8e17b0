"""Parts of the renderer that can be used alone: nearest points, eigen decompositions, comparison, picture files."""

from __future__ import annotations

import os
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _halflight
from ._arrays import picture, rows32
from ._errors import SettingsError
from ._picture import View, stops


class Photons:
    """A k-d tree over points in single precision, for exact searches of the nearest (Jensen 1996)."""

    def __init__(self, positions: ArrayLike) -> None:
        self._map = _halflight.Photons(rows32(positions, "positions"))

    def __len__(self) -> int:
        return len(self._map)

    def nearest(
        self, points: ArrayLike, k: int, radius: float = np.inf
    ) -> tuple[NDArray[np.int64], NDArray[np.float32]]:
        """Indices and distances, (n, k) each, of the k nearest positions within `radius`, nearest first.

        Where there are fewer, indices are -1 and distances infinite; with fewer than k positions in all, rows are
        shorter.
        """
        if k < 1:
            raise SettingsError(f"k={k}: a search finds at least one point")
        indices, squared = self._map.nearest(rows32(points, "points"), k, float(radius))
        return indices, np.sqrt(squared, out=squared)


@dataclass(frozen=True)
class Eigen:
    """Eigen decompositions of n symmetric matrices of d rows."""

    #: Eigenvalues, the largest magnitude first, (n, d).
    values: NDArray[np.float32]
    #: Unit eigenvectors as rows, in the order of the values, (n, d, d).
    vectors: NDArray[np.float32]


def eigen(matrices: ArrayLike) -> Eigen:
    """Eigen decompositions of symmetric matrices, as Hessians of irradiance are: (n, 2, 2) or (n, 3, 3)."""
    array = np.asarray(matrices, np.float32)
    if array.ndim != 3 or array.shape[1:] not in ((2, 2), (3, 3)):
        raise SettingsError(f"matrices have the shape {array.shape}; (n, 2, 2) or (n, 3, 3) is expected")
    count, size = len(array), array.shape[1]
    rows, columns = np.triu_indices(size)
    upper = np.ascontiguousarray(array[:, rows, columns])
    if size == 2:
        found = _halflight.decompose2(upper)
        x, y = found[:, 2], found[:, 3]
        vectors = np.stack([x, y, -y, x], axis=1).reshape(count, 2, 2)
        return Eigen(found[:, :2], vectors)
    found = _halflight.decompose3(upper)
    return Eigen(found[:, :3], found[:, 3:].reshape(count, 3, 3))


@dataclass(frozen=True)
class Comparison:
    """Errors of a picture against a reference."""

    relmse: float
    mse: float
    rmse: float
    #: Mean visible difference by LDR-FLIP, 0 to 1.
    flip: float
    mean: float
    reference_mean: float
    #: Pixels of the picture that are not finite, and were left out.
    non_finite: int


def compare(image: Any, reference: Any) -> Comparison:
    """Compares pictures, or arrays (rows, columns, 3), of the same size."""
    return Comparison(**_halflight.compare(picture(image), picture(reference)))


def flip(image: Any, reference: Any) -> NDArray[np.float32]:
    """The LDR-FLIP error of each pixel, (rows, columns), 0 to 1."""
    return _halflight.flip(picture(image), picture(reference))


def read_image(path: str | os.PathLike[str]) -> NDArray[np.float32]:
    """A picture file as linear sRGB, (rows, columns, 3): EXR, HDR, PFM, PNG, JPEG, BMP, TGA, WebP or TIFF."""
    return _halflight.read_image(os.fspath(path))


def save_image(
    path: str | os.PathLike[str],
    image: Any,
    *,
    exposure: float | Literal["auto"] = 0.0,
    view: View = "clamp",
) -> None:
    """Writes a picture or an array (rows, columns, 3) as .png, .exr, .hdr or .pfm."""
    _halflight.write_image(os.fspath(path), picture(image), stops(exposure), view)
