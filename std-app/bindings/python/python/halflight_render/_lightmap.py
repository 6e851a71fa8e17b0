"""A baked lightmap, with the error of its texels."""

from __future__ import annotations

import os

import numpy as np
from numpy.typing import NDArray

from . import _halflight


class Lightmap:
    """Irradiance of the texels of charts in W/m², rows from the top, where v is 1."""

    def __init__(self, baked: _halflight.Lightmap) -> None:
        self._baked = baked
        layers = baked.layers()
        #: Irradiance in linear sRGB, (rows, columns, 3), or with `directional` a and b of a + b·n, (4, rows, columns, 3).
        self.irradiance: NDArray[np.float32] = layers[0] if len(layers) == 1 else layers
        #: Half-width of the 95 % interval of the luminance of each texel, (rows, columns).
        self.error: NDArray[np.float32] = baked.half_widths()
        #: 2 for computed texels, 1 for those filled from neighbours, 0 outside of charts, (rows, columns).
        self.coverage: NDArray[np.uint8] = baked.coverage()

    @property
    def charts(self) -> int:
        """Number of charts."""
        return self._baked.charts

    @property
    def notes(self) -> list[str]:
        """Doubtful charts, one sentence each."""
        return self._baked.notes

    @property
    def seconds(self) -> float:
        """Seconds of sampling."""
        return self._baked.seconds

    def at(self, texcoords: NDArray[np.floating]) -> NDArray[np.float32]:
        """Irradiance of the texels at texture coordinates, (n, 2)."""
        rows, columns = self.coverage.shape
        u, v = np.asarray(texcoords, np.float64).T
        column = np.clip((u * columns).astype(np.int64), 0, columns - 1)
        row = np.clip(((1 - v) * rows).astype(np.int64), 0, rows - 1)
        found: NDArray[np.float32] = self.irradiance[..., row, column, :]
        return found

    def save(self, path: str | os.PathLike[str]) -> None:
        """Writes the values as .exr with the coverage as alpha, .hdr or .pfm."""
        self._baked.save(os.fspath(path), False)

    def save_error(self, path: str | os.PathLike[str]) -> None:
        """Writes the half-widths of the intervals."""
        self._baked.save(os.fspath(path), True)

    def __repr__(self) -> str:
        rows, columns = self.coverage.shape
        return f"<Lightmap {columns}×{rows} of {self.charts} charts, {self.seconds:.2g} s>"
