"""Denoised pictures with an estimate of their error, by Open Image Denoise (`pip install halflight-render[denoise]`).

Two pictures A and B of the same view with different seeds are independent, and B has a known variance. The denoised
A, D(A), depends on A alone, so that the mean of (D(A) - B)² - Var(B) is an unbiased estimate of the squared error of
D(A): no reference is needed. The picture that is returned is denoised from both. Its error follows from those of D(A)
and of denoised halves of A, whose ratio is taken to stay the same from step to step.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ._errors import SettingsError
from ._picture import Picture

#: Rows and columns of a block.
BLOCK = 16

Pixels = NDArray[np.float32]


@dataclass(frozen=True)
class Denoised:
    """A denoised picture and where its error lies."""

    #: The denoised mean of both pictures, (rows, columns, 3).
    image: Pixels
    #: Estimate of its relMSE; equal to `upper` for pictures without halves.
    relmse: float
    #: Upper estimate of its relMSE: that of one denoised picture of the two.
    upper: float
    #: Standard error of `upper`.
    standard_error: float
    #: relMSE of the mean of both pictures, which is not denoised.
    noisy_relmse: float
    #: relMSE of a single denoised picture by blocks of 16 × 16 pixels, and its standard error.
    blocks: NDArray[np.float64]
    block_errors: NDArray[np.float64]
    #: relMSE of a single noisy picture by blocks.
    noisy_blocks: NDArray[np.float64]
    #: The filter.
    denoiser: Callable[[Pixels], Pixels]

    def of(self, picture: Picture) -> Pixels:
        """Another picture of the view, denoised in the same way."""
        return self.denoiser(picture.image)

    @property
    def worse(self) -> NDArray[np.bool_]:
        """True for blocks where the denoised picture is worse than the noisy one, by two standard errors."""
        found: NDArray[np.bool_] = self.blocks - 2 * self.block_errors > self.noisy_blocks
        return found


def oidn(image: Pixels, albedo: Pixels | None = None, normal: Pixels | None = None) -> Pixels:
    """The picture denoised by Open Image Denoise, with layers if there are some."""
    try:
        import pyoidn
    except ImportError as error:
        raise ImportError("denoising needs pyoidn: pip install halflight-render[denoise]") from error
    layers = () if albedo is None else (albedo,) if normal is None else (albedo, normal)
    denoised: Pixels = np.asarray(pyoidn.denoise(np.ascontiguousarray(image), *layers, hdr=True), np.float32)
    return denoised


def denoise(
    first: Picture, second: Picture | None = None, *, denoiser: Callable[[Pixels], Pixels] | None = None
) -> Denoised:
    """Denoises two renders of one view with different seeds and `reconstruct=False`, or the halves of one.

    Pictures with `layers=["halves"]` have a better estimate of the error. Open Image Denoise is the default, with the
    layers albedo and normal if the pictures have them. Another `denoiser` maps a picture to a better one, and need not
    be a neural network.
    """
    pictures = [first] if second is None else [first, second]
    for picture in pictures:
        if picture.spp < 4:
            raise SettingsError(f"the error of a denoised picture needs 4 samples per pixel, not {picture.spp}")
        if picture.findings.get("reconstruction", {}).get("decision") == "used":
            raise SettingsError("a reconstructed picture is denoised already: render with reconstruct=False")
    quarters: list[Pixels] = []
    if second is None:
        a, b = (half.astype(np.float64) for half in first.halves)
        variance_a = variance_b = (a - b) ** 2 / 2
    else:
        if first.image.shape != second.image.shape:
            raise SettingsError("the pictures differ in size")
        if np.array_equal(first.image, second.image):
            raise SettingsError("the pictures are the same: render them with different seeds")
        a, b = (picture.image.astype(np.float64) for picture in pictures)
        variance_a, variance_b = (picture.variance.astype(np.float64) for picture in pictures)
        if all("even.R" in picture.layers for picture in pictures):
            quarters = [*first.halves, *second.halves]
    apply = denoiser or _with_layers(first)
    mean = (a + b) / 2
    both = _applied(apply, mean)
    # A denoiser that brightens a place, or spreads a lamp, must not lower the weight of its error there. Samples that
    # find no light must not raise it.
    seen = np.maximum(np.abs(mean), _medians(mean))
    weight = 1 / (np.minimum(np.abs(both), seen) ** 2 + 0.01 * mean.mean() ** 2)

    def error(denoised: NDArray[np.float64], other: NDArray[np.float64], variance: NDArray[np.float64]) -> Any:
        return ((denoised - other) ** 2 - variance) * weight

    errors = (error(_applied(apply, a), b, variance_b) + error(_applied(apply, b), a, variance_a)) / 2
    noisy = (variance_a + variance_b) * weight / 2
    blocks, deviations = _blocks(errors.mean(axis=2))
    upper = relmse = float(errors.mean())
    if quarters:
        others = ((b, variance_b), (b, variance_b), (a, variance_a), (a, variance_a))
        pairs = zip(quarters, others, strict=True)
        before = float(np.mean([error(_applied(apply, part), *other) for part, other in pairs]))
        relmse = upper * min(max(upper / max(before, 1e-30), 0.5), 1.0)
    # A picture of both that is worse than those of each: its error correlates with its own noise, so that this is a
    # lower estimate.
    of_both = ((both - a) * (both - b) * weight).mean(axis=2)
    least = float(of_both.mean() - 2 * of_both.std() / np.sqrt(of_both.size))
    return Denoised(
        image=both.astype(np.float32),
        relmse=max(relmse, least),
        upper=max(upper, least),
        standard_error=float(errors.mean(axis=2).std() / np.sqrt(of_both.size)),
        noisy_relmse=float(noisy.mean() / 2),
        blocks=blocks,
        block_errors=deviations,
        noisy_blocks=_blocks(noisy.mean(axis=2))[0],
        denoiser=apply,
    )


def _with_layers(picture: Picture) -> Callable[[Pixels], Pixels]:
    """Open Image Denoise with the layers of a picture."""
    if "albedo.R" not in picture.layers:
        return oidn
    albedo = np.clip(picture.albedo, 0, 1)
    normal = picture.normal if "normal.X" in picture.layers else None
    return lambda image: oidn(image, albedo, normal)


def _applied(denoiser: Callable[[Pixels], Pixels], image: NDArray[Any]) -> NDArray[np.float64]:
    return np.asarray(denoiser(np.asarray(image, np.float32)), np.float64)


def _medians(image: NDArray[np.float64]) -> NDArray[np.float64]:
    """Medians of 3 × 3 pixels."""
    padded = np.pad(image, ((1, 1), (1, 1), (0, 0)), "edge").astype(np.float32)
    windows = np.lib.stride_tricks.sliding_window_view(padded, (3, 3), (0, 1))
    channels = [np.median(windows[:, :, channel], axis=(-1, -2)) for channel in range(image.shape[2])]
    return np.stack(channels, axis=2).astype(np.float64)


def _blocks(pixels: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Means of blocks and their standard errors; blocks at the border are smaller."""
    rows, columns = (-(-side // BLOCK) for side in pixels.shape)
    means, errors = np.empty((rows, columns)), np.empty((rows, columns))
    for row, column in np.ndindex(rows, columns):
        part: NDArray[Any] = pixels[BLOCK * row :, BLOCK * column :][:BLOCK, :BLOCK]
        means[row, column] = part.mean()
        errors[row, column] = part.std() / np.sqrt(part.size)
    return means, errors
