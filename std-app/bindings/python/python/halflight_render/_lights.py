"""Lights without surface of scenes from arrays: points, spots, parallel light, environments and skies."""

from __future__ import annotations

import re
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._arrays import pixels, triple
from ._errors import SceneError, SettingsError

Triple = tuple[float, float, float]


@dataclass(frozen=True)
class Point:
    """A light at a point, with its radiant intensity in W/sr."""

    position: ArrayLike
    intensity: ArrayLike


@dataclass(frozen=True)
class Spot:
    """A light at a point into a cone; angles are half-angles in degrees."""

    position: ArrayLike
    look_at: ArrayLike
    #: Radiant intensity on the axis, W/sr.
    intensity: ArrayLike
    #: Angle from which there is no light.
    angle: float = 45.0
    #: Angle up to which the intensity is full.
    inner_angle: float = 0.0


@dataclass(frozen=True)
class Directional:
    """Parallel light from infinity."""

    #: Direction in which the light travels, of any length.
    direction: ArrayLike
    #: Irradiance on a surface that faces it, W/m².
    irradiance: ArrayLike


Light = Point | Spot | Directional


@dataclass(frozen=True, eq=False)
class Environment:
    """Radiance from all directions, as a picture (rows, 2 rows, 3) of latitude and longitude, +y up.

    Column i of W has the azimuth phi = 2 pi (i + 0.5) / W, which is (sin theta cos phi, cos theta, sin theta sin phi).
    """

    pixels: ArrayLike
    #: Factor on the picture.
    radiance: ArrayLike = 1.0
    #: Rotation from directions of the picture to the world, (3, 3).
    to_world: ArrayLike | None = None


@dataclass(frozen=True, eq=False)
class Sky:
    """A clear sky with a sun: `[sky]` of scene files. Give `sun`, or date, time, latitude and longitude."""

    #: Direction to the sun.
    sun: ArrayLike | None = None
    #: Day, "2026-06-21".
    date: str | None = None
    #: Time with its offset from universal time, "15:30+02:00".
    time: str | None = None
    #: Degrees, north and east positive.
    latitude: float | None = None
    longitude: float | None = None
    #: 1 (pure air) to 10 (haze).
    turbidity: float = 3.0
    #: Reflectance of the ground.
    ground_albedo: ArrayLike = 0.2
    #: Factor on the light of sky and sun, and a further one on that of the sun.
    intensity: float = 1.0
    sun_intensity: float = 1.0
    #: Direction to the zenith.
    up: ArrayLike = (0.0, 1.0, 0.0)
    #: Horizontal direction to the north; None is -z.
    north: ArrayLike | None = None

    def entries(self) -> list[tuple[str, str]]:
        """Names and values in the language of scene files, a line each."""
        given = {field.name: getattr(self, field.name) for field in fields(self)}
        return [(name, _toml(value, name)) for name, value in given.items() if value is not None]


def _toml(value: ArrayLike, name: str) -> str:
    if isinstance(value, str):
        return '"' + value.replace("\\", "\\\\").replace('"', '\\"') + '"'
    return str(list(triple(value, name))) if np.ndim(value) else repr(float(np.asarray(value, np.float64)))


EnvironmentParts = (
    Triple
    | str
    | tuple[NDArray[np.uint8] | NDArray[np.float32], Triple, tuple[Triple, Triple, Triple]]
)


def environment_parts(environment: ArrayLike | Environment | Sky | None) -> EnvironmentParts | None:
    """Light from afar in the layout of the library: a radiance, a picture, or the text of a sky."""
    if environment is None:
        return None
    if isinstance(environment, Sky):
        return "[sky]\n" + "".join(f"{name} = {value}\n" for name, value in environment.entries())
    if not isinstance(environment, Environment):
        if np.ndim(environment) < 2:
            return triple(environment, "environment")
        environment = Environment(environment)
    rotation = np.eye(3) if environment.to_world is None else np.asarray(environment.to_world, np.float64)
    if rotation.shape != (3, 3) or not np.allclose(rotation @ rotation.T, np.eye(3), atol=1e-4):
        raise SettingsError("to_world of the environment is no rotation (3, 3)")
    x, y, z = (triple(row, "to_world") for row in rotation)
    array = pixels(environment.pixels, "environment", 3)
    if array.dtype == np.uint8:
        raise SettingsError("environment has bytes; a picture of radiances is of floats")
    return array, triple(environment.radiance, "radiance of the environment"), (x, y, z)


def named(error: SceneError, environment: object) -> SceneError:
    """The error of a sky, which refers to a line of its text, with the name of the argument."""
    if error.file != "sky" or not isinstance(environment, Sky):
        return error
    entries = environment.entries()
    at = (error.line or 1) - 2
    where = f"{entries[at][0]} of the sky" if 0 <= at < len(entries) else "sky"
    return SceneError(re.sub(r"^sky(:\d+)*", where, str(error)), None, None, error.help)


@dataclass(frozen=True)
class LightParts:
    """A light in the layout of the library."""

    kind: str
    position: Triple
    direction: Triple
    color: Triple
    angles: tuple[float, float] = (0.0, 0.0)


def _unit(vector: ArrayLike, name: str) -> Triple:
    x, y, z = triple(vector, name)
    length = float(np.sqrt(x * x + y * y + z * z))
    if not 0 < length < np.inf:
        raise SettingsError(f"{name} has no direction")
    return x / length, y / length, z / length


def light_parts(light: Light) -> LightParts:
    """A light in the layout of the library."""
    zero = (0.0, 0.0, 0.0)
    if isinstance(light, Point):
        return LightParts("point", triple(light.position, "position"), zero, triple(light.intensity, "intensity"))
    if isinstance(light, Spot):
        if not (0 <= light.inner_angle <= light.angle and 0.05 <= light.angle <= 180):
            raise SettingsError("angles of a spot are 0 <= inner_angle <= angle, and angle 0.05 to 180 degrees")
        position = triple(light.position, "position")
        along = np.subtract(triple(light.look_at, "look_at"), position)
        intensity = triple(light.intensity, "intensity")
        return LightParts(
            "spot", position, _unit(along, "look_at - position"), intensity, (light.inner_angle, light.angle)
        )
    if not isinstance(light, Directional):
        raise SettingsError(f"lights have a {type(light).__name__}; Point, Spot and Directional are expected")
    direction = _unit(light.direction, "direction")
    return LightParts("directional", zero, direction, triple(light.irradiance, "irradiance"))
