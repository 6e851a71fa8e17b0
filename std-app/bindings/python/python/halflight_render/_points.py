"""Results at points and of rays."""

from __future__ import annotations

import os
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from . import _halflight


@dataclass(frozen=True, repr=False)
class Irradiance:
    """Irradiance of n points in W/m², each value with its 95 % interval."""

    #: Irradiance per channel of linear sRGB, (n, 3).
    rgb: NDArray[np.float32]
    #: Its luminance, (n,).
    value: NDArray[np.float32]
    #: Lower and upper end of the interval of `value`, (n,).
    lower: NDArray[np.float32]
    upper: NDArray[np.float32]
    #: Illuminance in lux, by Radiance's 179 lm/W, and the ends of its interval, (n,).
    lux: NDArray[np.float32]
    lux_lower: NDArray[np.float32]
    lux_upper: NDArray[np.float32]
    #: Number of samples, (n,).
    samples: NDArray[np.uint32]
    #: Fraction of rays that first meet the back of a surface, (n,): near 1 for a point within a solid.
    back_faces: NDArray[np.float32]
    #: Seconds of sampling.
    seconds: float

    @property
    def valid(self) -> NDArray[np.bool_]:
        """True where there is an interval, and most rays meet no back of a surface."""
        good: NDArray[np.bool_] = np.isfinite(self.upper)
        return good & (self.back_faces < 0.5) if self.back_faces.size else good

    def __len__(self) -> int:
        return len(self.value)

    def __repr__(self) -> str:
        if not len(self):
            return "<Irradiance of 0 points>"
        mean, half = float(self.value.mean()), float(np.median(self.upper - self.lower)) / 2
        text = f"mean {mean:.3g} W/m², intervals of ±{half:.2g}, {self.seconds:.2g} s"
        return f"<Irradiance of {len(self)} points, {text}>"


@dataclass(frozen=True, repr=False)
class Hits:
    """Nearest hits of n rays."""

    #: Distance in lengths of the directions, infinite without a hit, (n,).
    t: NDArray[np.float64]
    #: Row of `Scene.triangles`, -1 without a hit, (n,).
    triangle: NDArray[np.int64]
    #: Weights of the second and third corner of the triangle, (n, 2).
    weights: NDArray[np.float32]
    #: Unit shading normal on the side of the ray, NaN without a hit, (n, 3).
    normal: NDArray[np.float32]
    #: Index into `Scene.materials`, -1 without a hit, (n,).
    material: NDArray[np.int64]

    @property
    def hit(self) -> NDArray[np.bool_]:
        """True where the ray hits a triangle, (n,)."""
        return self.triangle >= 0

    def __len__(self) -> int:
        return len(self.t)

    def __repr__(self) -> str:
        return f"<Hits of {len(self)} rays, {int(self.hit.sum())} on triangles>"


def read_points(path: str | os.PathLike[str]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Points and normals, (n, 3) each, of a file with a line `x y z nx ny nz` for each point."""
    return _halflight.read_sensors(os.fspath(path))
