"""Scenes from files and from arrays."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from inspect import signature
from typing import TYPE_CHECKING, Literal, NoReturn

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _halflight
from ._arrays import indices, picture, rows64, triple
from ._errors import SceneError, SettingsError
from ._lightmap import Lightmap
from ._lights import Environment, Light, Sky, environment_parts, light_parts, named
from ._materials import Material, Triple, parts
from ._picture import Picture
from ._points import Hits, Irradiance
from ._progress import shown
from ._settings import Settings, refuse_unknown, words

if TYPE_CHECKING:
    from typing_extensions import Unpack

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
class Camera:
    """A camera in the coordinates of the scene. A render replaces what is None by the camera of the scene."""

    eye: ArrayLike | None = None
    look_at: ArrayLike | None = None
    up: ArrayLike | None = None
    #: Vertical field of view in degrees.
    fov: float | None = None
    #: Radius of the lens, and its distance in focus; 0 is a pinhole.
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
        meshes: Sequence[Mesh] | Mesh,
        lights: Sequence[Light] = (),
        *,
        environment: ArrayLike | Environment | Sky | None = None,
        camera: Camera | None = None,
        memory: int | None = None,
    ) -> None:
        """Makes a scene from arrays, with the repairs of the loader (`notes`).

        `environment` is the radiance of rays that leave the scene: a number or three, a picture, or a `Sky`. `memory`
        limits bytes.
        """
        materials: dict[Material, int] = {}
        given = []
        for number, mesh in enumerate([meshes] if isinstance(meshes, Mesh) else meshes):
            material = materials.setdefault(mesh.material, len(materials))
            name = mesh.name or f"mesh {number}"
            normals = None if mesh.normals is None else rows64(mesh.normals, f"normals of {name}")
            texcoords = mesh.texcoords
            coords = None if texcoords is None else rows64(texcoords, f"texcoords of {name}", 2)
            positions = rows64(mesh.positions, f"positions of {name}")
            triangles = indices(mesh.triangles, f"triangles of {name}")
            given.append((name, positions, normals, coords, triangles, material))
        textures, surfaces = parts(materials)
        _distinct([surface.name for surface in surfaces])
        view = None
        if camera is not None:
            if camera.eye is None or camera.look_at is None:
                raise SettingsError("the camera of a scene from arrays has an eye and a look_at")
            up = (0.0, 1.0, 0.0) if camera.up is None else triple(camera.up, "up")
            fov = 40.0 if camera.fov is None else float(camera.fov)
            if not 0 < fov < 178:
                raise SettingsError("a field of view is more than 0 and less than 178 degrees")
            view = (triple(camera.eye, "eye"), triple(camera.look_at, "look_at"), up, fov)
        afar = environment_parts(environment)
        converted = [light_parts(light) for light in lights]
        try:
            self._renderer = _halflight.build(given, (textures, surfaces), converted, afar, view, memory)
        except SceneError as error:
            raise named(error, environment) from None
        self._has_charts = True
        self._camera = None if camera is None or camera.lens is None else Camera(lens=camera.lens)

    @classmethod
    def _opened(cls, path: str, memory: int | None, charts: bool) -> Scene:
        scene = cls.__new__(cls)
        scene._renderer = _halflight.open(path, memory, charts)
        scene._has_charts = charts
        scene._camera = None
        return scene

    @property
    def notes(self) -> list[str]:
        """What the loader repaired, a sentence for each kind, and that nothing emits light."""
        return self._renderer.notes

    @property
    def positions(self) -> NDArray[np.float64]:
        """Vertex positions, (n, 3)."""
        return self._renderer.positions

    @property
    def texcoords(self) -> NDArray[np.float32]:
        """Texture coordinates of the vertices, (n, 2); (0, 2) if nothing uses them."""
        return self._renderer.texcoords

    @property
    def objects(self) -> list[str]:
        """Names of the objects, to which `Picture.object` refers."""
        return self._renderer.object_names

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
        if (folder := settings.get("report")) is not None:
            made.report(folder)
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
        method: PointMethod = "path",
        progress: Callable[[_halflight.Progress], object] | bool | None = None,
        **unknown: NoReturn,
    ) -> Irradiance:
        """Irradiance of points, (n, 3), on the side of their normals, (n, 3), or one normal for all.

        `error` is the half-width of the intervals of 95 % of the points of each tile of near points, relative to the
        value and a tenth of the mean. Without `spp`, `seconds` and `error`: 2 %, or a minute.
        """
        _refuse_others(Scene.irradiance, unknown)
        places, directions = _rays(points, normals, "points", "normals")
        keywords = _positive(
            spp=spp,
            seconds=seconds,
            error=error,
            light=light,
            caustics=caustics,
            seed=seed,
            max_depth=max_depth,
            threads=threads,
            back_faces=back_faces,
            method=method,
        )
        with shown(progress) as callback:
            baked, ended = _halflight.irradiance(
                self._renderer, places, directions, keywords, callback
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

    def bake_lightmap(
        self,
        size: tuple[int, int],
        subject: str | None = None,
        *,
        spp: int | None = None,
        seconds: float | None = None,
        error: float | None = None,
        supersample: int = 1,
        pad: int = 4,
        directional: bool = False,
        light: Literal["all", "direct", "indirect"] = "all",
        caustics: bool = True,
        seed: int = 0,
        max_depth: int | None = None,
        threads: int | None = None,
        method: PointMethod = "path",
        progress: Callable[[_halflight.Progress], object] | bool | None = None,
        **unknown: NoReturn,
    ) -> Lightmap:
        """Irradiance of the texels of a map of `size` (columns, rows) over the texture coordinates.

        `subject` is the name of a mesh, an object or a material; None is all. The end is that of `irradiance`. A scene
        of a file is opened with `charts=True`.
        """
        _refuse_others(Scene.bake_lightmap, unknown)
        if not self._has_charts:
            raise SettingsError("texture coordinates of files are kept by `hl.open(path, charts=True)` alone")
        columns, rows = size
        for name, value in (("size", columns), ("size", rows), ("supersample", supersample)):
            if not 1 <= value <= 1 << 16:
                raise SettingsError(f"{name}={value}: a number from 1 to 65536 is expected")
        keywords = _positive(
            spp=spp,
            seconds=seconds,
            error=error,
            light=light,
            caustics=caustics,
            seed=seed,
            max_depth=max_depth,
            threads=threads,
            back_faces=True,
            method=method,
        )
        with shown(progress) as callback:
            baked, ended = _halflight.lightmap(
                self._renderer, ((columns, rows), subject, supersample, pad, directional), keywords, callback
            )
        found = Lightmap(baked)
        if ended is not None:
            if isinstance(ended, KeyboardInterrupt):
                ended.lightmap = found  # type: ignore[attr-defined]
            raise ended
        return found

    def trace(self, origins: ArrayLike, directions: ArrayLike) -> Hits:
        """Nearest hits of rays, (n, 3) each, or one origin or direction for all. Cut-outs and panes count as whole
        triangles.
        """
        rays = _rays(origins, directions, "origins", "directions")
        t, triangle, weights, normal, material = self._renderer.trace(*rays)
        return Hits(t, triangle, weights, normal, material)

    def occluded(
        self, origins: ArrayLike, directions: ArrayLike, t_max: ArrayLike = np.inf
    ) -> NDArray[np.bool_]:
        """True for each ray that hits anything within `t_max` lengths of its direction, (n,)."""
        starts, ways = _rays(origins, directions, "origins", "directions")
        limits = np.asarray(t_max, np.float64)
        every = None if limits.ndim == 0 and np.isinf(limits) else np.broadcast_to(limits, len(starts)).tolist()
        return self._renderer.occluded(starts, ways, every)

    def __repr__(self) -> str:
        return f"<Scene of {len(self.triangles)} triangles>"


PointMethod = Literal["path", "irradiance-cache", "auto"]


def _rays(
    starts: ArrayLike, ways: ArrayLike, *names: str
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Positions and directions, (n, 3) each; a single one of three numbers serves all of the others."""
    given = [np.asarray(values, np.float64) for values in (starts, ways)]
    shape = max((array.shape for array in given), key=len)
    if len(shape) == 2:
        given = [np.broadcast_to(array, (shape[0], 3)) if array.shape == (3,) else array for array in given]
    first, second = (rows64(array, name) for array, name in zip(given, names, strict=True))
    return first, second


def _refuse_others(function: Callable[..., object], unknown: Mapping[str, object]) -> None:
    """Refuses keywords that `function` does not name, with the nearest one."""
    if unknown:
        known = signature(function).parameters.values()
        refuse_unknown(unknown, [setting.name for setting in known if setting.kind == setting.KEYWORD_ONLY])


def _positive(**keywords: object) -> dict[str, object]:
    """The keywords of irradiance; numbers are above 0."""
    for name in ("spp", "seconds", "error", "threads"):
        value = keywords[name]
        if isinstance(value, int | float) and not value > 0:
            raise SettingsError(f"{name}={value}: a number above 0 is expected")
    return keywords


def _distinct(names: Sequence[str]) -> None:
    """Refuses materials that share a name."""
    twice = {name for name in names if names.count(name) > 1}
    if twice:
        raise SettingsError(f"different materials have the name {min(twice)!r}")


def open(path: str | os.PathLike[str], *, memory: int | None = None, charts: bool = False) -> Scene:
    """Loads a scene file (.toml), a mesh (.obj) or glTF (.glb, .gltf), within `memory` bytes.

    With `charts`, texture coordinates are those of the files, as `bake_lightmap` needs them.
    """
    return Scene._opened(os.fspath(path), memory, charts)
