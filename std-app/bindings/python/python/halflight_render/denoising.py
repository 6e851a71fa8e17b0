"""Denoised pictures with an estimate of their error, by Open Image Denoise (`pip install halflight-render[denoise]`).

Two pictures A and B of the same view with different seeds are independent, and B has a known variance. The denoised
A, D(A), depends on A alone, so that the mean of (D(A) - B)² - Var(B) is an unbiased estimate of the squared error of
D(A): no reference is needed. The picture that is returned is denoised from both, which is better than D(A) and D(B);
their mean error is an upper estimate.
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
    #: Upper estimate of its relMSE.
    relmse: float
    #: relMSE of the mean of both pictures, which is not denoised.
    noisy_relmse: float
    #: relMSE of a single denoised picture by blocks of 16 × 16 pixels, and its standard error.
    blocks: NDArray[np.float64]
    block_errors: NDArray[np.float64]
    #: relMSE of a single noisy picture by blocks.
    noisy_blocks: NDArray[np.float64]

    @property
    def worse(self) -> NDArray[np.bool_]:
        """True for blocks where the denoised picture is worse than the noisy one, by two standard errors."""
        found: NDArray[np.bool_] = self.blocks - 2 * self.block_errors > self.noisy_blocks
        return found


def oidn(image: Pixels) -> Pixels:
    """The picture denoised by Open Image Denoise."""
    try:
        import pyoidn
    except ImportError as error:
        raise ImportError("denoising needs pyoidn: pip install halflight-render[denoise]") from error
    denoised: Pixels = np.asarray(pyoidn.denoise(np.ascontiguousarray(image), hdr=True), np.float32)
    return denoised


def denoise(
    first: Picture, second: Picture, *, denoiser: Callable[[Pixels], Pixels] = oidn
) -> Denoised:
    """Denoises two renders of one view with different seeds and `reconstruct=False`.

    `denoiser` maps a picture to a better one, and need not be a neural network.
    """
    for picture in (first, second):
        if picture.spp < 4:
            raise SettingsError(f"the error of a denoised picture needs 4 samples per pixel, not {picture.spp}")
        if picture.findings.get("reconstruction", {}).get("decision") == "used":
            raise SettingsError("a reconstructed picture is denoised already: render with reconstruct=False")
    if first.image.shape != second.image.shape:
        raise SettingsError("the pictures differ in size")
    if np.array_equal(first.image, second.image):
        raise SettingsError("the pictures are the same: render them with different seeds")
    a, b = (picture.image.astype(np.float64) for picture in (first, second))
    mean = np.asarray((a + b) / 2, np.float32)
    both = denoiser(mean).astype(np.float64)
    # A denoiser that spreads a lamp over its surroundings must not lower the weight of their error.
    weight = 1 / (np.minimum(np.abs(both), np.abs(mean)) ** 2 + 0.01 * both.mean() ** 2)
    of_a = denoiser(first.image).astype(np.float64)
    of_b = denoiser(second.image).astype(np.float64)
    errors = ((of_a - b) ** 2 - second.variance + (of_b - a) ** 2 - first.variance) * weight / 2
    noisy = (first.variance + second.variance) * weight / 2
    blocks, deviations = _blocks(errors.mean(axis=2))
    return Denoised(
        image=both.astype(np.float32),
        relmse=float(errors.mean()),
        noisy_relmse=float(noisy.mean() / 2),
        blocks=blocks,
        block_errors=deviations,
        noisy_blocks=_blocks(noisy.mean(axis=2))[0],
    )


def _blocks(pixels: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Means of blocks and their standard errors; blocks at the border are smaller."""
    rows, columns = (-(-side // BLOCK) for side in pixels.shape)
    means, errors = np.empty((rows, columns)), np.empty((rows, columns))
    for row, column in np.ndindex(rows, columns):
        part: NDArray[Any] = pixels[BLOCK * row :, BLOCK * column :][:BLOCK, :BLOCK]
        means[row, column] = part.mean()
        errors[row, column] = part.std() / np.sqrt(part.size)
    return means, errors
