"""A rendered picture with the estimate of its error."""

from __future__ import annotations

import base64
import html
import json
import os
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from . import _halflight
from ._errors import SettingsError

View = Literal["clamp", "neutral", "agx"]


class Picture:
    """A picture, its error, and how it was made. Arrays are shared: copy them before you change them."""

    def __init__(self, rendered: _halflight.Rendered) -> None:
        self._rendered = rendered
        self._info: dict[str, Any] | None = None
        self._layers: dict[str, NDArray[np.float32]] | None = None

    @property
    def image(self) -> NDArray[np.float32]:
        """Linear sRGB radiance, (rows, columns, 3), rows from top to bottom."""
        return self._rendered.image

    @property
    def variance(self) -> NDArray[np.float32]:
        """Estimated variance of each channel of each pixel, (rows, columns, 3)."""
        return self._rendered.variance

    @property
    def samples(self) -> NDArray[np.uint32]:
        """Samples of each pixel, (rows, columns)."""
        return self._rendered.samples

    @property
    def layers(self) -> dict[str, NDArray[np.float32]]:
        """Channels of the layers by name, as `albedo.R`, (rows, columns) each (docs/layers.md)."""
        if self._layers is None:
            self._layers = self._rendered.layers()
        return self._layers

    def _layer(self, name: str, channels: str, wanted: str | None = None) -> NDArray[np.float32]:
        parts = [self.layers.get(f"{name}.{channel}") for channel in channels]
        found = [part for part in parts if part is not None]
        if len(found) < len(channels):
            layer = wanted or name
            wanted_layers = f"render with layers={[layer]}, and long enough for them"
            raise SettingsError(f"the picture has no layer {layer!r}\n  help: {wanted_layers}", help=wanted_layers)
        return np.stack(found, axis=-1) if len(found) > 1 else found[0]

    @property
    def albedo(self) -> NDArray[np.float32]:
        """Light that the surface reflects, behind mirrors and glass, (rows, columns, 3)."""
        return self._layer("albedo", "RGB")

    @property
    def normal(self) -> NDArray[np.float32]:
        """Mean shading normal towards the viewer, behind mirrors and glass, (rows, columns, 3); 0 for the sky."""
        return self._layer("normal", "XYZ")

    @property
    def depth(self) -> NDArray[np.float32]:
        """Distance of the first surface from the camera, (rows, columns); 0 for the sky."""
        return self._layer("depth", "Z")

    @property
    def position(self) -> NDArray[np.float32]:
        """Point of the first surface, (rows, columns, 3); 0 for the sky."""
        return self._layer("position", "XYZ")

    @property
    def material(self) -> NDArray[np.int32]:
        """Index into `Scene.materials` of the most frequent material of the pixel, -1 for the sky, (rows, columns)."""
        return self._layer("material", "X").astype(np.int32)

    @property
    def object(self) -> NDArray[np.int32]:
        """Index into `Scene.objects` of the most frequent object of the pixel, -1 for the sky, (rows, columns)."""
        return self._layer("object", "X").astype(np.int32)

    @property
    def halves(self) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """Means of the even and of the odd samples: two independent pictures, (rows, columns, 3) each."""
        return self._layer("even", "RGB", "halves"), self._layer("odd", "RGB", "halves")

    @property
    def error(self) -> NDArray[np.float32]:
        """Standard deviation of the noise of each channel of each pixel, (rows, columns, 3)."""
        return np.sqrt(self.variance)

    @property
    def relmse(self) -> float | None:
        """Estimated relMSE: the mean squared error relative to the squared picture; None below four samples."""
        return None if self._rendered.error is None else self._rendered.error[0]

    @property
    def interval(self) -> tuple[float, float] | None:
        """95 % interval of `relmse`."""
        return None if self._rendered.error is None else self._rendered.error[1:]

    @property
    def spp(self) -> int:
        """Samples per pixel."""
        return self._rendered.spp

    @property
    def method(self) -> str:
        """Name of the method that made it."""
        return self._rendered.method

    @property
    def seconds(self) -> float:
        """Seconds of rendering."""
        return self._rendered.seconds

    @property
    def unsaved(self) -> list[str]:
        """Checkpoints and caches that could not be written, one sentence each."""
        return self._rendered.unsaved

    @property
    def info(self) -> dict[str, Any]:
        """The object that `halflight render --json` prints (docs/cli.md): times, memory, history and more."""
        if self._info is None:
            self._info = json.loads(self._rendered.object())
        return self._info

    @property
    def findings(self) -> dict[str, Any]:
        """What the method decided, and why."""
        findings: dict[str, Any] = self.info["findings"]
        return findings

    @property
    def ending(self) -> str:
        """Why rendering ended: done, interrupted, biased or noise-floor."""
        return str(self.info["ending"])

    def save(
        self,
        path: str | os.PathLike[str],
        *,
        exposure: float | Literal["auto"] = 0.0,
        view: View = "clamp",
    ) -> None:
        """Writes .png, .exr, .hdr or .pfm; stops of `exposure` and the curve `view` are for PNG alone.

        An .exr has the layers, and the error, the settings and the seed as attributes.
        """
        if os.fspath(path).lower().endswith(".exr"):
            self._rendered.save_exr(os.fspath(path))
            return
        _halflight.write_image(os.fspath(path), self.image, stops(exposure), view)

    def png(self, *, exposure: float | Literal["auto"] = 0.0, view: View = "clamp") -> bytes:
        """The bytes of a PNG file."""
        return self._rendered.png(stops(exposure), view)

    def report(self, folder: str | os.PathLike[str]) -> None:
        """Writes index.html, curve.csv and run.json: the picture, maps of its error, error against time."""
        self._rendered.report(os.fspath(folder))

    def caption(self) -> str:
        """Method, samples, error and time in a line."""
        rows, columns, _ = self.image.shape
        parts = [f"{columns}×{rows}", f"{self.spp} spp by {self.method}"]
        if self.interval is not None:
            lower, upper = self.interval
            parts.append(f"relMSE {self.relmse:.2e}, 95 %: {lower:.2e} to {upper:.2e}")
        return ", ".join([*parts, f"{self.seconds:.2g} s"])

    def __repr__(self) -> str:
        return f"<Picture {self.caption()}>"

    def _repr_png_(self) -> bytes:
        return self.png()

    def _repr_html_(self) -> str:
        data = base64.b64encode(self.png()).decode("ascii")
        caption = html.escape(self.caption())
        picture = f'<img alt="{caption}" src="data:image/png;base64,{data}">'
        return f"<figure>{picture}<figcaption>{caption}</figcaption></figure>"


def stops(exposure: float | Literal["auto"]) -> float | None:
    """Stops of an exposure; None for `auto`."""
    return None if exposure == "auto" else float(exposure)
