"""Materials of scenes from arrays. Each colour and number may be a texture."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._arrays import pixels, triple
from ._errors import SettingsError

Triple = tuple[float, float, float]

#: Kinds of surfaces.
KINDS = ("diffuse", "mirror", "metal", "coated", "glass", "pane")


@dataclass(frozen=True, eq=False)
class Texture:
    """A picture over the texture coordinates of a mesh, (rows, columns, 3) or (rows, columns).

    Texture coordinates (0, 1) are the first pixel of the first row, and the picture repeats. Bytes of colours are in
    the sRGB curve, other bytes are fractions of 255; floats are linear.
    """

    pixels: NDArray[np.uint8] | NDArray[np.float32]

    @classmethod
    def of(cls, values: ArrayLike | Texture, name: str, channels: int = 3, *, most: float = np.inf) -> Texture:
        """The texture of the argument `name`; a number of `channels` is the most that it may have."""
        if isinstance(values, Texture):
            return values
        array = pixels(values, name, channels)
        if array.dtype != np.uint8 and np.any(array > most):
            raise SettingsError(f"{name} has values up to {np.nanmax(array):g}; {most:g} is the most")
        return cls(array)


Color = Triple | Texture
Number = float | Texture


def _is_texture(values: ArrayLike | Texture) -> bool:
    return isinstance(values, Texture) or np.ndim(values) > 1


def color(values: ArrayLike | Texture, name: str) -> Color:
    """A reflectance: a number, three, or a picture."""
    return Texture.of(values, name, most=1.0) if _is_texture(values) else triple(_plain(values), name)


def radiance(values: ArrayLike | Texture, name: str) -> Color:
    """A radiance: a number, three, or a picture."""
    return Texture.of(values, name) if _is_texture(values) else triple(_plain(values), name)


def number(value: ArrayLike | Texture, name: str) -> Number:
    """A number from 0 to 1, or a picture of one channel."""
    if _is_texture(value):
        return Texture.of(value, name, 1, most=1.0)
    if np.ndim(_plain(value)) != 0:
        raise SettingsError(f"{name} is {value!r}; a number from 0 to 1 or a picture (rows, columns) is expected")
    return float(np.asarray(_plain(value), np.float64))


def _plain(values: ArrayLike | Texture) -> ArrayLike:
    assert not isinstance(values, Texture)
    return values


@dataclass(frozen=True)
class Material:
    """A material; `diffuse`, `mirror`, `metal`, `coated`, `plastic`, `glass`, `pane` and `lamp` make them."""

    kind: str = "diffuse"
    #: Reflectance, or the tint of glass, 0 to 1 per channel.
    color: Color = (0.5, 0.5, 0.5)
    #: Reflectance of a coat at normal incidence.
    specular: Color = (0.04, 0.04, 0.04)
    #: Square root of GGX's alpha, 0 to 1.
    roughness: Number = 0.0
    #: 0 is a coat over a base, 1 a metal.
    metallic: Number = 0.0
    #: Index of refraction; None for a coat that does not change the light of its base.
    ior: float | None = None
    #: Radiance that the front emits, W/(m² sr).
    emission: Color = (0.0, 0.0, 0.0)
    #: True if the back emits as well.
    two_sided: bool = False
    #: Probability that a ray hits the surface.
    opacity: Number = 1.0
    #: Normals in the tangent space, and their strength; or heights and their factor.
    normals: tuple[Texture, float] | None = None
    heights: tuple[Texture, float] | None = None
    #: Name in notes of the loader.
    name: str = ""

    def __post_init__(self) -> None:
        if self.kind not in KINDS:
            raise SettingsError(f"kind={self.kind!r}: expected one of {', '.join(KINDS)}")
        if self.kind in ("glass", "pane") and isinstance(self.color, Texture):
            raise SettingsError(f"the tint of {self.kind} is a number or three, not a picture")
        for name in ("color", "specular"):
            value = getattr(self, name)
            if not isinstance(value, Texture) and not all(0 <= channel <= 1 for channel in value):
                raise SettingsError(f"{name} is {value}; channels are 0 to 1")
        for name in ("roughness", "metallic", "opacity"):
            value = getattr(self, name)
            if not isinstance(value, Texture) and not 0 <= value <= 1:
                raise SettingsError(f"{name} is {value}; a number from 0 to 1 is expected")
        if not isinstance(self.emission, Texture) and not all(0 <= channel <= 1e30 for channel in self.emission):
            raise SettingsError(f"emission is {self.emission}; radiance is 0 or above")
        least = 1.0 if self.kind == "pane" else 0.001
        if self.ior is not None and not least <= self.ior <= 100:
            raise SettingsError(f"ior is {self.ior}; an index of refraction is {least} to 100")

    def emitting(self, light: ArrayLike | Texture, *, two_sided: bool = False) -> Material:
        """The material with this emitted radiance."""
        return replace(self, emission=radiance(light, "radiance"), two_sided=two_sided)

    def cut_out(self, opacity: ArrayLike | Texture) -> Material:
        """The material with holes: where `opacity` is 0, rays pass."""
        return replace(self, opacity=number(opacity, "opacity"))

    def with_normals(self, normals: ArrayLike | Texture, strength: float = 1.0) -> Material:
        """The material with a normal map: n = 2 x - 1, green is up."""
        return replace(self, normals=(Texture.of(normals, "normals"), float(strength)), heights=None)

    def bumped(self, heights: ArrayLike | Texture, scale: float = 0.01) -> Material:
        """The material with heights, in units of the texture coordinates."""
        return replace(self, heights=(Texture.of(heights, "heights", 1), float(scale)), normals=None)


def diffuse(reflectance: ArrayLike | Texture) -> Material:
    """A Lambertian surface."""
    return Material("diffuse", color(reflectance, "reflectance"))


def mirror(reflectance: ArrayLike | Texture = 1.0) -> Material:
    """A perfect mirror."""
    return Material("mirror", color(reflectance, "reflectance"))


def metal(reflectance: ArrayLike | Texture, roughness: ArrayLike | Texture = 0.0) -> Material:
    """A GGX metal with this reflectance at normal incidence."""
    return Material("metal", color(reflectance, "reflectance"), roughness=number(roughness, "roughness"))


def coated(
    base: ArrayLike | Texture,
    roughness: ArrayLike | Texture = 0.0,
    *,
    specular: ArrayLike | Texture = 0.04,
    ior: float | None = None,
    metallic: ArrayLike | Texture = 0.0,
) -> Material:
    """A diffuse base below a specular coat, as varnish is."""
    return Material(
        "coated",
        color(base, "base"),
        color(specular, "specular"),
        roughness=number(roughness, "roughness"),
        metallic=number(metallic, "metallic"),
        ior=ior,
    )


def plastic(base: ArrayLike | Texture, roughness: ArrayLike | Texture = 0.0, *, ior: float = 1.5) -> Material:
    """A diffuse base below the coat of a dielectric with this index."""
    return coated(base, roughness, specular=((ior - 1) / (ior + 1)) ** 2, ior=ior)


def glass(ior: float = 1.5, roughness: ArrayLike | Texture = 0.0, *, tint: ArrayLike = 1.0) -> Material:
    """The boundary of a solid of glass or water."""
    return Material("glass", triple(tint, "tint"), roughness=number(roughness, "roughness"), ior=ior)


def pane(ior: float = 1.5, *, tint: ArrayLike = 1.0) -> Material:
    """A thin pane: two faces as one surface."""
    return Material("pane", triple(tint, "tint"), ior=ior)


def lamp(radiance: ArrayLike | Texture, *, two_sided: bool = False) -> Material:
    """A black surface that emits this radiance from its front."""
    return diffuse(0.0).emitting(radiance, two_sided=two_sided)


#: A factor on a texture, or a value, and the number of the texture.
Input3 = tuple[Triple, int | None]
Input1 = tuple[float, int | None]


@dataclass(frozen=True)
class Parts:
    """A material in the layout of the library: textures by their numbers."""

    name: str
    kind: str
    color: Input3
    specular: Input3
    roughness: Input1
    metallic: Input1
    ior: float | None
    emission: Input3
    two_sided: bool
    opacity: Input1
    normals: tuple[int, float] | None
    heights: tuple[int, float] | None


TextureParts = tuple[str, NDArray[np.uint8] | NDArray[np.float32], bool]


def parts(materials: Iterable[Material]) -> tuple[list[TextureParts], list[Parts]]:
    """Textures, each once, and materials that refer to them. Materials without a name get one."""
    numbers: dict[tuple[int, bool], int] = {}
    textures: list[TextureParts] = []
    found: list[Parts] = []

    def of(texture: Texture, name: str, has_colours: bool) -> int:
        key = (id(texture), has_colours)
        if key not in numbers:
            numbers[key] = len(textures)
            textures.append((name, texture.pixels, has_colours))
        return numbers[key]

    for count, material in enumerate(materials):
        name = material.name or f"material {count}"

        def color(part: str, material: Material = material, name: str = name) -> Input3:
            value = getattr(material, part)
            is_texture = isinstance(value, Texture)
            return ((1.0, 1.0, 1.0), of(value, f"{part} of {name}", True)) if is_texture else (value, None)

        def number(part: str, material: Material = material, name: str = name) -> Input1:
            value = getattr(material, part)
            return (1.0, of(value, f"{part} of {name}", False)) if isinstance(value, Texture) else (value, None)

        def relief(part: str, material: Material = material, name: str = name) -> tuple[int, float] | None:
            value = getattr(material, part)
            return None if value is None else (of(value[0], f"{part} of {name}", False), value[1])

        found.append(
            Parts(
                name=name,
                kind=material.kind,
                color=color("color"),
                specular=color("specular"),
                roughness=number("roughness"),
                metallic=number("metallic"),
                ior=material.ior,
                emission=color("emission"),
                two_sided=material.two_sided,
                opacity=number("opacity"),
                normals=relief("normals"),
                heights=relief("heights"),
            )
        )
    return textures, found
