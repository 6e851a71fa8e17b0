"""Radiance scenes and skies, by pyradiance (`pip install halflight-render[daylight]`).

Radiance files become meshes, skies of gensky and gendaylit an environment and a directional light. Values are
Radiance's watts; `Irradiance.lux` has its 179 lm/W. Up is +z, as in Radiance.
"""

from __future__ import annotations

import argparse
import os
import shlex
import subprocess
import sys
import tempfile
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from ._errors import Error, SceneError, SettingsError
from ._materials import Triple
from ._points import Irradiance, read_points
from ._scene import Scene
from ._scene import open as open_scene
from ._tools import save_image

#: Segments of a circle, by which round surfaces are replaced.
SEGMENTS = 48

#: Materials that emit.
LIGHTS = ("light", "glow", "illum")

Polygon = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Sky:
    """Light from a sky and from the sun."""

    #: Radiance of the sky without the sun, latitude-longitude, (rows, 2 rows, 3).
    radiance: NDArray[np.float32]
    #: Direction to the sun and its irradiance on a surface that faces it; None without a sun.
    sun: tuple[Triple, Triple] | None


def _pyradiance() -> Any:
    try:
        import pyradiance
    except ImportError as error:
        raise ImportError("daylight needs pyradiance: pip install halflight-render[daylight]") from error
    return pyradiance


def gensky(*args: Any, rows: int = 256, **keywords: Any) -> Sky:
    """The sky of `pyradiance.gensky` with these arguments (CIE)."""
    return sky(_pyradiance().gensky(*args, **keywords), rows=rows)


def gendaylit(*args: Any, rows: int = 256, **keywords: Any) -> Sky:
    """The sky of `pyradiance.gendaylit` with these arguments (Perez)."""
    return sky(_pyradiance().gendaylit(*args, **keywords), rows=rows)


def sky(text: bytes | str, *, rows: int = 256) -> Sky:
    """The sky of a Radiance description with a brightness function `skyfunc`, which has the ground too."""
    radiance = _pyradiance()
    described = text.encode() if isinstance(text, str) else text
    primitives = radiance.parse_primitive(described.decode())
    lights = {p.identifier: p.fargs for p in primitives if p.ptype == "light"}
    suns = [p for p in primitives if p.ptype == "source" and p.modifier in lights]
    sun = None
    if suns:
        x, y, z, degrees = suns[0].fargs
        solid_angle = np.pi * np.sin(np.radians(degrees) / 2) ** 2
        length = float(np.sqrt(x * x + y * y + z * z))
        red, green, blue = (float(channel * solid_angle) for channel in lights[suns[0].modifier])
        sun = (x / length, y / length, z / length), (red, green, blue)
    kept = b"\n".join(p.bytes for p in primitives if p not in suns and p.identifier not in lights)
    has_dome = any(p.ptype == "source" and p not in suns for p in primitives)
    dome = b"" if has_dome else (
        b"\nskyfunc glow halflight_sky 0 0 4 1 1 1 0\nhalflight_sky source halflight_dome 0 0 4 0 0 1 180\n"
        b"halflight_sky source halflight_ground 0 0 4 0 0 -1 180\n"
    )
    values = _traced(radiance, kept + dome, _directions(rows))
    return Sky(values.reshape(rows, 2 * rows, 3).astype(np.float32), sun)


def _directions(rows: int) -> NDArray[np.float64]:
    """Directions of the pixels of an environment map, row by row."""
    theta, phi = np.meshgrid(
        (np.arange(rows) + 0.5) / rows * np.pi, (np.arange(2 * rows) + 0.5) / rows * np.pi, indexing="ij"
    )
    parts = (np.sin(theta) * np.cos(phi), np.cos(theta), np.sin(theta) * np.sin(phi))
    # The pole of the map is +z: (x, y, z) of the map is (x, z, -y) of the world, turned about x.
    x, y, z = (part.ravel() for part in parts)
    return np.column_stack([x, -z, y])


#: From directions of the map to the world.
TO_WORLD = [[1, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0]]


def _traced(radiance: Any, described: bytes, directions: NDArray[np.float64]) -> NDArray[np.float64]:
    """Radiance of the dome in these directions."""
    rays = np.hstack([np.zeros_like(directions), directions]).astype(np.float32)
    with tempfile.TemporaryDirectory() as folder:
        octree = Path(folder) / "sky.oct"
        octree.write_bytes(radiance.oconv(stdin=described))
        found = radiance.rtrace(rays.tobytes(), str(octree), header=False, inform="f", outform="f")
    return np.frombuffer(found, np.float32).reshape(-1, 3).astype(np.float64)


def scene(
    files: Iterable[str | os.PathLike[str]] | str | os.PathLike[str], *, sky: Sky | None = None, memory: int | None = None
) -> Scene:
    """The scene of Radiance files, whose commands are run, below `sky`.

    Polygons, spheres, cylinders, cones and rings of the materials plastic, metal, mirror, glass, dielectric, light,
    glow and illum are accepted; patterns, textures and mixtures are refused.
    """
    files = [files] if isinstance(files, str | os.PathLike) else files
    return _built([p for file in files for p in _primitives(Path(file))], sky, memory)


def point_in_time(
    octree: str | os.PathLike[str],
    grid: str | os.PathLike[str],
    *,
    metric: Literal["illuminance", "irradiance"] = "illuminance",
    output: str | os.PathLike[str] | None = None,
    **keywords: Any,
) -> tuple[NDArray[np.float64], Irradiance]:
    """The command `honeybee-radiance raytrace point-in-time` with halflight in the place of rtrace.

    `octree` names the files of its scene and of its sky, relative to its folder; the lines of `grid` are
    `x y z nx ny nz`. Returns the numbers that rcalc makes of rtrace's colours, and the irradiances with their
    intervals. `output` is a .res file of those numbers; keywords are those of `Scene.irradiance`.
    """
    if metric not in ("illuminance", "irradiance"):
        raise SettingsError(f"metric={metric!r}: expected one of illuminance, irradiance")
    room = of_octree(octree)
    found = room.irradiance(*read_points(grid), **keywords)
    values: NDArray[np.float64] = found.rgb.astype(np.float64) @ HONEYBEE
    if metric == "illuminance":
        values *= 179.0
    if output is not None:
        np.savetxt(output, values, "%.7g")
    return values, found


#: Weights of red, green and blue by which Honeybee makes a number of a colour.
HONEYBEE = np.array([0.265, 0.67, 0.065])


def of_octree(octree: str | os.PathLike[str], *, memory: int | None = None) -> Scene:
    """The scene of the files that an octree names, with its sky."""
    file = Path(octree)
    program = Path(str(_pyradiance().BINPATH)) / "getinfo"
    header = subprocess.run([program, file], capture_output=True, check=False).stdout.decode(errors="replace")
    commands = [shlex.split(line) for line in header.splitlines() if line.strip().startswith("oconv ")]
    words = [word for command in commands for word in command if (file.parent / word).is_file()]
    if not words:
        raise SceneError(f"{file}: no octree, or one whose files are not in its folder", str(file))
    primitives = [p for word in words for p in _primitives(file.parent, word)]
    sources = [p for p in primitives if p.ptype == "source"]
    of_sky = {p.modifier for p in sources}
    # Modifiers of modifiers, as `skyfunc` of `sky_glow`.
    for p in reversed(primitives):
        if p.identifier in of_sky and p.ptype not in _SHAPES:
            of_sky.add(p.modifier)
    used = {p.modifier for p in primitives if p.ptype in _SHAPES}
    described = [p for p in primitives if p in sources or (p.identifier in of_sky and p.identifier not in used)]
    light = sky(b"\n".join(p.bytes for p in described)) if sources else None
    return _built([p for p in primitives if p not in described], light, memory)


def _built(primitives: Sequence[Any], sky: Sky | None, memory: int | None) -> Scene:
    text: list[str] = []
    materials: dict[str, dict[str, Any]] = {}
    for primitive in primitives:
        if primitive.ptype in _SHAPES:
            text += [f"usemtl {primitive.modifier}", *_faces(_SHAPES[primitive.ptype](primitive.fargs))]
        elif primitive.ptype != "source":
            materials[primitive.identifier] = _material(primitive)
    used = {line.split(" ", 1)[1] for line in text if line.startswith("usemtl ")}
    missing = sorted(used - materials.keys() - {"void"})
    if missing:
        raise SceneError(f"there is no material `{missing[0]}`\n  help: name the file that has it first")
    materials["void"] = {"kind": "diffuse", "color": 0.0}
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "scene.obj").write_text("\n".join(text) + "\n")
        entries = ["[[mesh]]", 'file = "scene.obj"']
        if sky is not None:
            save_image(folder / "sky.pfm", sky.radiance)
            entries += ["[environment]", 'map = "sky.pfm"', f"to_world = {TO_WORLD}"]
            if sky.sun is not None:
                direction, irradiance = sky.sun
                entries += ["[[light]]", 'kind = "directional"', f"direction = {[-part for part in direction]}"]
                entries += [f"irradiance = {list(irradiance)}"]
        for material in sorted(used):
            entries.append(f'[material."{material}"]')
            entries += [f"{key} = {_value(value)}" for key, value in materials[material].items()]
        (folder / "scene.toml").write_text("\n".join(entries) + "\n")
        return open_scene(folder / "scene.toml", memory=memory)


def _value(value: Any) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    return f'"{value}"' if isinstance(value, str) else str(value)


def _primitives(file: Path, name: str | None = None) -> list[Any]:
    """Primitives of a file, or of `name` in a folder, with the output of its commands."""
    radiance = _pyradiance()
    program = Path(str(radiance.BINPATH)) / "xform"
    # Commands name files relative to the folder of theirs.
    folder, name = (file.parent, file.name) if name is None else (file, name)
    done = subprocess.run([program, "-e", name], cwd=folder, capture_output=True, check=False)
    # A command that fails is a message alone.
    if done.returncode or done.stderr:
        problem = done.stderr.decode(errors="replace").strip()
        raise SceneError(f"{file}: {problem}", str(file))
    found: list[Any] = radiance.parse_primitive(done.stdout.decode())
    return found


def _material(primitive: Any) -> dict[str, Any]:
    """Keys of a scene file for a material of Radiance."""
    kind, numbers = primitive.ptype, list(primitive.fargs)
    if primitive.modifier != "void":
        problem = f"`{primitive.identifier}` is modified by `{primitive.modifier}`"
        raise SceneError(f"{problem}: patterns and textures are not supported")
    if kind in ("plastic", "metal"):
        color, (specular, roughness) = numbers[:3], numbers[3:5]
        if specular == 0:
            return {"kind": "diffuse", "color": color}
        base = [channel * (1 - specular) for channel in color]
        coat = [(channel if kind == "metal" else 1.0) * specular for channel in color]
        return {"kind": "diffuse", "color": base, "specular": coat, "roughness": min(roughness**0.5, 1.0)}
    if kind == "mirror":
        return {"kind": "mirror", "color": numbers[:3]}
    if kind == "glass":
        return {"kind": "pane", "ior": numbers[3] if len(numbers) > 3 else 1.52, "tint": numbers[:3]}
    if kind == "dielectric":
        return {"kind": "glass", "ior": numbers[3], "tint": numbers[:3]}
    if kind in LIGHTS:
        return {"kind": "diffuse", "color": 0.0, "emission": numbers[:3]}
    problem = f"`{primitive.identifier}` is of the kind `{kind}`"
    raise SceneError(f"{problem}: plastic, metal, mirror, glass, dielectric and lights are supported")


def _faces(polygons: Sequence[Polygon]) -> Iterator[str]:
    """Lines of OBJ with vertices relative to their own."""
    for polygon in polygons:
        yield from (f"v {x!r} {y!r} {z!r}" for x, y, z in polygon.tolist())
        yield "f " + " ".join(str(index - len(polygon)) for index in range(len(polygon)))


def _polygon(numbers: Sequence[float]) -> list[Polygon]:
    return [np.reshape(numbers, (-1, 3))]


def _rings(points: NDArray[np.float64]) -> list[Polygon]:
    """Quadrilaterals between circles of points, (circles, segments, 3)."""
    following = np.roll(points, -1, axis=1)
    corners = np.stack([points[:-1], following[:-1], following[1:], points[1:]], axis=2)
    return list(corners.reshape(-1, 4, 3))


def _circle(axis: NDArray[np.float64]) -> NDArray[np.float64]:
    """Unit vectors around an axis, counter-clockwise seen from its end."""
    axis = axis / np.linalg.norm(axis)
    first = np.cross(axis, np.eye(3)[np.argmin(np.abs(axis))])
    first /= np.linalg.norm(first)
    angles = np.arange(SEGMENTS) / SEGMENTS * 2 * np.pi
    circle: NDArray[np.float64] = np.outer(np.cos(angles), first)
    return circle + np.outer(np.sin(angles), np.cross(axis, first))


def _cone(numbers: Sequence[float]) -> list[Polygon]:
    start, end = np.reshape(numbers[:6], (2, 3))
    radii = numbers[6], numbers[7] if len(numbers) > 7 else numbers[6]
    circle = _circle(end - start)
    return _rings(np.stack([at + radius * circle for at, radius in zip((start, end), radii, strict=True)]))


def _ring(numbers: Sequence[float]) -> list[Polygon]:
    circle = _circle(np.asarray(numbers[3:6]))
    inner, outer = sorted(numbers[6:8])
    if inner == 0:
        return [numbers[:3] + outer * circle]
    return _rings(np.stack([numbers[:3] + radius * circle for radius in (outer, inner)]))


def _sphere(numbers: Sequence[float]) -> list[Polygon]:
    latitudes = np.linspace(-np.pi / 2, np.pi / 2, SEGMENTS // 2 + 1)[1:-1]
    circle, up = _circle(np.array([0.0, 0.0, 1.0])), np.array([0.0, 0.0, 1.0])
    points = np.stack([np.cos(angle) * circle + np.sin(angle) * up for angle in latitudes])
    caps = [np.stack([end * up, a, b][:: int(end)]) for end, row in ((-1, points[0]), (1, points[-1]))
            for a, b in zip(row, np.roll(row, -1, axis=0), strict=True)]
    center, radius = np.asarray(numbers[:3]), numbers[3]
    return [center + radius * polygon for polygon in [*_rings(points), *caps]]


_SHAPES = {"polygon": _polygon, "cone": _cone, "cylinder": _cone, "ring": _ring, "sphere": _sphere}


def main() -> None:
    """The command: octree, grid, and the file of the numbers."""
    parser = argparse.ArgumentParser(prog="python -m halflight_render.daylight", description=point_in_time.__doc__)
    parser.add_argument("octree")
    parser.add_argument("grid")
    parser.add_argument("--metric", choices=("illuminance", "irradiance"), default="illuminance")
    parser.add_argument("--output", required=True)
    parser.add_argument("--error", type=float, help="half-width of the intervals, relative")
    parser.add_argument("--spp", type=int, help="samples of each sensor")
    parser.add_argument("--seconds", type=float)
    parser.add_argument("--threads", type=int)
    parser.add_argument("--method", choices=("path", "irradiance-cache", "auto"), default="path")
    try:
        _, found = point_in_time(**vars(parser.parse_args()))
    except Error as error:
        sys.exit(f"error: {error}")
    half = (found.upper - found.value) / np.maximum(found.value, 1e-9)
    print(f"{len(found)} sensors, median half-width of the intervals {np.median(half):.1%}, {found.seconds:.2g} s")


if __name__ == "__main__":
    main()
