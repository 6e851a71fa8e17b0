"""Scenes from files and from arrays."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _halflight
from ._arrays import indices, picture, rows64, triple
from ._errors import SettingsError
from ._picture import Picture
from ._points import Hits, Irradiance
from ._progress import shown
from ._settings import Settings, words

if TYPE_CHECKING:
    from typing_extensions import Unpack

Triple = tuple[float, float, float]


@dataclass(frozen=True)
class Material:
    """A material; `diffuse`, `mirror`, `metal`, `coated`, `glass`, `pane` and `lamp` make them."""

    kind: str = "diffuse"
    #: Reflectance, or the tint of glass, 0 to 1 per channel.
    color: Triple = (0.5, 0.5, 0.5)
    #: Reflectance of a coat at normal incidence.
    specular: Triple = (0.04, 0.04, 0.04)
    #: Square root of GGX's alpha, 0 to 1.
    roughness: float = 0.0
    #: 0 is a coat over a base, 1 a metal.
    metallic: float = 0.0
    #: Index of refraction; None for a coat that does not change the light of its base.
    ior: float | None = None
    #: Radiance that the front emits, W/(m² sr).
    emission: Triple = (0.0, 0.0, 0.0)
    #: True if the back emits as well.
    two_sided: bool = False
    #: Probability that a ray hits the surface.
    opacity: float = 1.0
    #: Name in notes of the loader.
    name: str = ""

    def __post_init__(self) -> None:
        for name in ("color", "specular"):
            if not all(0 <= channel <= 1 for channel in getattr(self, name)):
                raise SettingsError(f"{name} is {getattr(self, name)}; channels are 0 to 1")
        for name in ("roughness", "metallic", "opacity"):
            if not 0 <= getattr(self, name) <= 1:
                raise SettingsError(f"{name} is {getattr(self, name)}; a number from 0 to 1 is expected")
        if not all(0 <= channel <= 1e30 for channel in self.emission):
            raise SettingsError(f"emission is {self.emission}; radiance is 0 or above")
        least = 1.0 if self.kind == "pane" else 0.001
        if self.ior is not None and not least <= self.ior <= 100:
            raise SettingsError(f"ior is {self.ior}; an index of refraction is {least} to 100")

    def emitting(self, radiance: ArrayLike, *, two_sided: bool = False) -> Material:
        """The material with this emission."""
        return replace(self, emission=triple(radiance, "radiance"), two_sided=two_sided)


def diffuse(reflectance: ArrayLike) -> Material:
    """A Lambertian surface."""
    return Material("diffuse", triple(reflectance, "reflectance"))


def mirror(reflectance: ArrayLike = 1.0) -> Material:
    """A perfect mirror."""
    return Material("mirror", triple(reflectance, "reflectance"))


def metal(reflectance: ArrayLike, roughness: float = 0.0) -> Material:
    """A GGX metal with this reflectance at normal incidence."""
    return Material("metal", triple(reflectance, "reflectance"), roughness=roughness)


def coated(
    base: ArrayLike,
    roughness: float = 0.0,
    *,
    specular: ArrayLike = 0.04,
    ior: float | None = None,
    metallic: float = 0.0,
) -> Material:
    """A diffuse base below a specular coat, as plastic and varnish are."""
    color = triple(base, "base")
    return Material(
        "coated", color, triple(specular, "specular"), roughness=roughness, metallic=metallic, ior=ior
    )


def glass(ior: float = 1.5, roughness: float = 0.0, *, tint: ArrayLike = 1.0) -> Material:
    """The boundary of a solid of glass or water."""
    return Material("glass", triple(tint, "tint"), roughness=roughness, ior=ior)


def pane(ior: float = 1.5, *, tint: ArrayLike = 1.0) -> Material:
    """A thin pane: two faces as one surface."""
    return Material("pane", triple(tint, "tint"), ior=ior)


def lamp(radiance: ArrayLike, *, two_sided: bool = False) -> Material:
    """A black surface that emits this radiance from its front."""
    return diffuse(0.0).emitting(radiance, two_sided=two_sided)


@dataclass(frozen=True, eq=False)
class Mesh:
    """Triangles of one material."""

    #: Vertex positions, (n, 3).
    positions: ArrayLike
    #: Indices of vertices, counter-clockwise seen from the front, (m, 3).
    triangles: ArrayLike
    material: Material = Material()
    #: Shading normals of any length, (n, 3), or None.
    normals: ArrayLike | None = None
    #: Texture coordinates, (n, 2), or None.
    texcoords: ArrayLike | None = None
    #: Name in notes and errors.
    name: str = ""


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


@dataclass(frozen=True)
class _Light:
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


def _light(light: Light) -> _Light:
    zero = (0.0, 0.0, 0.0)
    if isinstance(light, Point):
        return _Light("point", triple(light.position, "position"), zero, triple(light.intensity, "intensity"))
    if isinstance(light, Spot):
        if not (0 <= light.inner_angle <= light.angle and 0.05 <= light.angle <= 180):
            raise SettingsError("angles of a spot are 0 <= inner_angle <= angle, and angle 0.05 to 180 degrees")
        position = triple(light.position, "position")
        along = np.subtract(triple(light.look_at, "look_at"), position)
        intensity = triple(light.intensity, "intensity")
        return _Light(
            "spot", position, _unit(along, "look_at - position"), intensity, (light.inner_angle, light.angle)
        )
    direction = _unit(light.direction, "direction")
    return _Light("directional", zero, direction, triple(light.irradiance, "irradiance"))


@dataclass(frozen=True)
class Camera:
    """A camera in the coordinates of the scene. A render replaces what is None by the camera of the scene."""

    eye: ArrayLike | None = None
    look_at: ArrayLike | None = None
    up: ArrayLike | None = None
    #: Vertical field of view in degrees.
    fov: float | None = None
    #: Radius of the lens, and its distance in focus; None is a pinhole.
    lens: float | tuple[float, float] | None = None

    def flags(self) -> dict[str, object]:
        """Settings of a render."""
        points = {name: getattr(self, name) for name in ("eye", "look_at", "up")}
        flags = {name: triple(value, name) for name, value in points.items() if value is not None}
        numbers = {name: getattr(self, name) for name in ("fov", "lens")}
        return flags | {name: value for name, value in numbers.items() if value is not None}


class Scene:
    """A scene with its hierarchy, lights and threads: one build for many views, from any thread."""

    _renderer: _halflight.Renderer

    def __init__(
        self,
        meshes: Sequence[Mesh],
        lights: Sequence[Light] = (),
        *,
        environment: ArrayLike | None = None,
        camera: Camera | None = None,
        memory: int | None = None,
    ) -> None:
        """Makes a scene from arrays, with the repairs of the loader (`notes`).

        `environment` is the radiance of rays that leave the scene; `memory` limits bytes.
        """
        materials: dict[Material, int] = {}
        parts = []
        for number, mesh in enumerate(meshes):
            material = materials.setdefault(mesh.material, len(materials))
            name = mesh.name or f"mesh {number}"
            normals = None if mesh.normals is None else rows64(mesh.normals, f"normals of {name}")
            texcoords = mesh.texcoords
            coords = None if texcoords is None else rows64(texcoords, f"texcoords of {name}", 2)
            positions = rows64(mesh.positions, f"positions of {name}")
            triangles = indices(mesh.triangles, f"triangles of {name}")
            parts.append((name, positions, normals, coords, triangles, material))
        named = [
            replace(material, name=material.name or f"material {number}")
            for material, number in materials.items()
        ]
        _distinct([material.name for material in named])
        view = None
        if camera is not None:
            if camera.eye is None or camera.look_at is None:
                raise SettingsError("the camera of a scene from arrays has an eye and a look_at")
            up = (0.0, 1.0, 0.0) if camera.up is None else triple(camera.up, "up")
            fov = 40.0 if camera.fov is None else float(camera.fov)
            if not 0 < fov < 178:
                raise SettingsError("a field of view is more than 0 and less than 178 degrees")
            view = (triple(camera.eye, "eye"), triple(camera.look_at, "look_at"), up, fov)
        sky = None if environment is None else triple(environment, "environment")
        converted = [_light(light) for light in lights]
        self._renderer = _halflight.build(parts, named, converted, sky, view, memory)
        self._camera = None if camera is None or camera.lens is None else Camera(lens=camera.lens)

    @classmethod
    def _opened(cls, path: str, memory: int | None) -> Scene:
        scene = cls.__new__(cls)
        scene._renderer = _halflight.open(path, memory)
        scene._camera = None
        return scene

    @property
    def notes(self) -> list[str]:
        """What the loader repaired, a sentence for each kind."""
        return self._renderer.notes

    @property
    def positions(self) -> NDArray[np.float64]:
        """Vertex positions, (n, 3)."""
        return self._renderer.positions

    @property
    def triangles(self) -> NDArray[np.uint32]:
        """Indices of vertices, (m, 3): those of the files after repairs."""
        return self._renderer.triangles

    @property
    def triangle_materials(self) -> NDArray[np.uint32]:
        """Index into `materials` of each triangle, (m,)."""
        return self._renderer.triangle_materials

    @property
    def materials(self) -> list[str]:
        """Names of the materials."""
        return self._renderer.material_names

    @property
    def meshes(self) -> list[tuple[str, range]]:
        """Names of the meshes, and their vertices."""
        return [(name, range(first, end)) for name, first, end in self._renderer.meshes]

    @property
    def bounds(self) -> tuple[Triple, Triple] | None:
        """Lower and upper corner of the bounding box; None for an empty scene."""
        return self._renderer.bounds

    def render(self, **settings: Unpack[Settings]) -> Picture:
        """Renders until `spp`, `seconds` or `error` is reached; without one until relMSE 1e-3, 60 s at most.

        `settings()` lists the keywords, which are the flags of `halflight render`. Ctrl-C raises KeyboardInterrupt
        with the picture so far as its attribute `picture`.
        """
        given = dict(settings)
        if self._camera is not None:
            given.setdefault("lens", self._camera.lens)
        flags = words(given)
        reference = settings.get("reference")
        if isinstance(reference, str | os.PathLike):
            reference = _halflight.read_image(os.fspath(reference))
        compared = None if reference is None else picture(reference)
        with shown(settings.get("progress")) as callback:
            rendered, ended = _halflight.render(self._renderer, flags, compared, callback)
        made = Picture(rendered)
        if ended is not None:
            if isinstance(ended, KeyboardInterrupt):
                ended.picture = made  # type: ignore[attr-defined]
            raise ended
        return made

    def irradiance(
        self,
        points: ArrayLike,
        normals: ArrayLike,
        *,
        spp: int | None = None,
        seconds: float | None = None,
        error: float | None = None,
        light: Literal["all", "direct", "indirect"] = "all",
        caustics: bool = True,
        seed: int = 0,
        max_depth: int | None = None,
        threads: int | None = None,
        back_faces: bool = False,
        progress: Callable[[_halflight.Progress], object] | bool | None = None,
    ) -> Irradiance:
        """Irradiance of points, (n, 3), on the side of their normals, (n, 3), or one normal for all.

        `error` is the half-width of the intervals of 95 % of the points of each tile of near points, relative to the
        value and a tenth of the mean. Without `spp`, `seconds` and `error`: 2 %, or a minute.
        """
        places = rows64(points, "points")
        directions = np.asarray(normals, np.float64)
        if directions.ndim == 1:
            directions = np.broadcast_to(directions, places.shape)
        for name, value in (("spp", spp), ("seconds", seconds), ("error", error), ("threads", threads)):
            if value is not None and not value > 0:
                raise SettingsError(f"{name}={value}: a number above 0 is expected")
        keywords = {
            "spp": spp,
            "seconds": seconds,
            "error": error,
            "light": light,
            "caustics": caustics,
            "seed": seed,
            "max_depth": max_depth,
            "threads": threads,
            "back_faces": back_faces,
        }
        with shown(progress) as callback:
            baked, ended = _halflight.irradiance(
                self._renderer, places, rows64(directions, "normals"), keywords, callback
            )
        found = Irradiance(
            rgb=baked["rgb"],
            value=baked["value"],
            lower=baked["value_lower"],
            upper=baked["value_upper"],
            lux=baked["lux"],
            lux_lower=baked["lux_lower"],
            lux_upper=baked["lux_upper"],
            samples=baked["samples"],
            back_faces=baked["back_faces"],
            seconds=baked["seconds"],
        )
        if ended is not None:
            if isinstance(ended, KeyboardInterrupt):
                ended.irradiance = found  # type: ignore[attr-defined]
            raise ended
        return found

    def trace(self, origins: ArrayLike, directions: ArrayLike) -> Hits:
        """Nearest hits of rays, (n, 3) each. Cut-outs and panes count as whole triangles."""
        t, triangle, weights, normal, material = self._renderer.trace(
            rows64(origins, "origins"), rows64(directions, "directions")
        )
        return Hits(t, triangle, weights, normal, material)

    def occluded(
        self, origins: ArrayLike, directions: ArrayLike, t_max: ArrayLike = np.inf
    ) -> NDArray[np.bool_]:
        """True for each ray that hits anything within `t_max` lengths of its direction, (n,)."""
        starts = rows64(origins, "origins")
        limits = np.asarray(t_max, np.float64)
        every = None if limits.ndim == 0 and np.isinf(limits) else np.broadcast_to(limits, len(starts)).tolist()
        return self._renderer.occluded(starts, rows64(directions, "directions"), every)

    def __repr__(self) -> str:
        return f"<Scene of {len(self.triangles)} triangles>"


def _distinct(names: Sequence[str]) -> None:
    """Refuses materials that share a name."""
    twice = {name for name in names if names.count(name) > 1}
    if twice:
        raise SettingsError(f"different materials have the name {min(twice)!r}")


def open(path: str | os.PathLike[str], *, memory: int | None = None) -> Scene:
    """Loads a scene file (.toml), a mesh (.obj) or glTF (.glb, .gltf), within `memory` bytes."""
    return Scene._opened(os.fspath(path), memory)
