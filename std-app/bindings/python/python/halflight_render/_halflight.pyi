"""Types of the extension module."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any, final

import numpy as np
from numpy.typing import NDArray

from ._lights import EnvironmentParts, LightParts
from ._materials import Parts, TextureParts

Triple = tuple[float, float, float]
MeshParts = tuple[
    str,
    NDArray[np.float64],
    NDArray[np.float64] | None,
    NDArray[np.float64] | None,
    NDArray[np.uint32],
    int,
]

@final
class Progress:
    """Work in progress, as a callback receives it."""

    @property
    def seconds(self) -> float:
        """Seconds so far."""
    @property
    def seconds_left(self) -> float | None:
        """Estimated seconds left."""
    @property
    def spp(self) -> int:
        """Samples per pixel, or of the least sampled point."""
    @property
    def relmse(self) -> float | None:
        """relMSE of the picture so far."""
    @property
    def interval(self) -> tuple[float, float] | None:
        """95 % interval of the relMSE."""
    @property
    def tiles(self) -> tuple[int, int] | None:
        """Tiles of near points, and those within the error; None for a picture."""
    @property
    def picture(self) -> NDArray[np.float32] | None:
        """The picture so far, made by this call; only during the callback."""

@final
class Rendered:
    @property
    def image(self) -> NDArray[np.float32]: ...
    @property
    def variance(self) -> NDArray[np.float32]: ...
    @property
    def samples(self) -> NDArray[np.uint32]: ...
    @property
    def error(self) -> tuple[float, float, float] | None: ...
    @property
    def spp(self) -> int: ...
    @property
    def method(self) -> str: ...
    @property
    def seconds(self) -> float: ...
    @property
    def unsaved(self) -> list[str]: ...
    def object(self) -> str: ...
    def layers(self) -> dict[str, NDArray[np.float32]]: ...
    def save_exr(self, path: str) -> None: ...
    def report(self, folder: str) -> None: ...
    def png(self, stops: float | None, curve: str) -> bytes: ...

@final
class Renderer:
    @property
    def notes(self) -> list[str]: ...
    @property
    def positions(self) -> NDArray[np.float64]: ...
    @property
    def texcoords(self) -> NDArray[np.float32]: ...
    @property
    def object_names(self) -> list[str]: ...
    @property
    def triangles(self) -> NDArray[np.uint32]: ...
    @property
    def triangle_materials(self) -> NDArray[np.uint32]: ...
    @property
    def material_names(self) -> list[str]: ...
    @property
    def meshes(self) -> list[tuple[str, int, int]]: ...
    @property
    def bounds(self) -> tuple[Triple, Triple] | None: ...
    def trace(
        self, origins: NDArray[np.float64], directions: NDArray[np.float64]
    ) -> tuple[
        NDArray[np.float64],
        NDArray[np.int64],
        NDArray[np.float32],
        NDArray[np.float32],
        NDArray[np.int64],
    ]: ...
    def occluded(
        self,
        origins: NDArray[np.float64],
        directions: NDArray[np.float64],
        limits: Sequence[float] | None,
    ) -> NDArray[np.bool_]: ...

@final
class Photons:
    def __init__(self, positions: NDArray[np.float32]) -> None: ...
    def __len__(self) -> int: ...
    def nearest(
        self, places: NDArray[np.float32], k: int, radius: float
    ) -> tuple[NDArray[np.int64], NDArray[np.float32]]: ...

@final
class Lightmap:
    @property
    def charts(self) -> int: ...
    @property
    def notes(self) -> list[str]: ...
    @property
    def seconds(self) -> float: ...
    def layers(self) -> NDArray[np.float32]: ...
    def half_widths(self) -> NDArray[np.float32]: ...
    def coverage(self) -> NDArray[np.uint8]: ...
    def save(self, path: str, has_errors: bool) -> None: ...

def open(path: str, memory: int | None, charts: bool) -> Renderer: ...
def lightmap(
    scene: Renderer,
    texels: tuple[tuple[int, int], str | None, int, int, bool],
    keywords: Mapping[str, object],
    callback: Callable[[Progress], object] | None,
) -> tuple[Lightmap, BaseException | None]: ...
def build(
    meshes: Sequence[MeshParts],
    materials: tuple[Sequence[TextureParts], Sequence[Parts]],
    lights: Sequence[LightParts],
    environment: EnvironmentParts | None,
    view: tuple[Triple, Triple, Triple, float] | None,
    memory: int | None,
) -> Renderer: ...
def render(
    scene: Renderer,
    words: Sequence[tuple[str, str]],
    reference: NDArray[np.float32] | None,
    callback: Callable[[Progress], object] | None,
) -> tuple[Rendered, BaseException | None]: ...
def irradiance(
    scene: Renderer,
    points: NDArray[np.float64],
    normals: NDArray[np.float64],
    keywords: Mapping[str, object],
    callback: Callable[[Progress], object] | None,
) -> tuple[dict[str, Any], BaseException | None]: ...
def read_sensors(path: str) -> tuple[NDArray[np.float64], NDArray[np.float64]]: ...
def keywords() -> list[str]: ...
def program(words: Sequence[str]) -> int: ...
def version() -> str: ...
def decompose2(matrices: NDArray[np.float32]) -> NDArray[np.float32]: ...
def decompose3(matrices: NDArray[np.float32]) -> NDArray[np.float32]: ...
def compare(shown: NDArray[np.float32], reference: NDArray[np.float32]) -> dict[str, Any]: ...
def flip(shown: NDArray[np.float32], reference: NDArray[np.float32]) -> NDArray[np.float32]: ...
def read_image(path: str) -> NDArray[np.float32]: ...
def write_image(path: str, picture: NDArray[np.float32], stops: float | None, curve: str) -> None: ...
def encode(picture: NDArray[np.float32], stops: float | None, curve: str) -> bytes: ...
