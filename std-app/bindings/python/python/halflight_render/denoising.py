"""Denoised pictures with an estimate of their error, by Open Image Denoise (`pip install halflight-render[denoise]`).

Two renders with halves are four independent pictures of the same view. A picture D that is denoised from two of them
knows nothing of the other two, c and d, so that the mean of (D - c)(D - d) is an unbiased estimate of its squared
error: no reference is needed. How much a third picture lowers the error is known with much less noise, since the
squares of the samples' noise cancel; the fourth lowers it by half as much again.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import combinations
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ._errors import SettingsError
from ._picture import Picture

#: Rows and columns of a block.
BLOCK = 16

Pixels = NDArray[np.float32]


#: Half-width of intervals, in standard errors, and the largest factor between the estimate and the upper end of its
#: interval with which an error is known.
QUANTILE = 2.0
WITHIN = 1.3

#: Standard errors by which a place differs from the samples for sure.
SURE = 3.0


@dataclass(frozen=True, repr=False)
class Denoised:
    """A denoised picture and where its error lies."""

    #: The denoised mean of both pictures, (rows, columns, 3).
    image: Pixels
    #: Estimate of its relMSE; without four parts that of a denoised part, which is larger.
    relmse: float
    #: 95 % interval of the relMSE of `image`.
    interval: tuple[float, float]
    #: relMSE of the mean of both pictures, which is not denoised.
    noisy_relmse: float
    #: relMSE by blocks of 16 × 16 pixels, and its standard error.
    blocks: NDArray[np.float64]
    block_errors: NDArray[np.float64]
    #: relMSE of the picture that is not denoised, by blocks.
    noisy_blocks: NDArray[np.float64]
    #: The filter.
    denoiser: Callable[[Pixels], Pixels]

    @property
    def known(self) -> bool:
        """True if the interval ends within a factor of 1.3 above `relmse`."""
        lower, upper = self.interval
        return lower > 0 and upper <= WITHIN * self.relmse

    def __repr__(self) -> str:
        (lower, upper), (rows, columns, _) = self.interval, self.image.shape
        text = "known" if self.known else "not known"
        return f"<Denoised {columns}×{rows}, relMSE {self.relmse:.2e}, 95 %: {lower:.2e} to {upper:.2e}, {text}>"

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

    The error is known of two pictures with `layers=["halves"]` alone; of others it has an upper end. Open Image
    Denoise is the default, with the layers albedo and normal if the pictures have them. Another `denoiser` maps a
    picture to a better one, and need not be a neural network.
    """
    parts, variance = _parts(first, second)
    apply = denoiser or _with_layers(first)
    mean = parts.mean(axis=0)
    both = _applied(apply, mean)
    weight = _weight(both, mean, variance)
    if len(parts) == 4:
        squares, noise = _of_four(apply, parts), variance
    else:
        (a, b), noise = parts, 2 * variance
        squares = ((_applied(apply, a) - b) ** 2 + (_applied(apply, b) - a) ** 2) / 2 - noise
    blocks, deviations = _blocks((squares * weight).mean(axis=2))
    found, deviation = _mean(squares * weight)
    # Nobody knows whether a dark pixel among bright ones lacks light or luck: here it lacks light.
    darkest = np.minimum(np.abs(both), np.abs(mean) + QUANTILE * np.sqrt(variance))
    most, _ = _mean(squares * _inverse_square(darkest, mean))
    # A picture of all that is worse than those of parts: its error correlates with its own noise, so that this is a
    # lower estimate.
    least, spread = _mean(np.mean([(both - a) * (both - b) for a, b in combinations(parts, 2)], axis=0) * weight)
    relmse, deviation = max((found, deviation), (least - QUANTILE * spread, spread))
    lower = max(relmse - QUANTILE * deviation, 0.0) if len(parts) == 4 else 0.0
    return Denoised(
        image=both.astype(np.float32),
        relmse=max(relmse, 0.0),
        interval=(lower, max(relmse + QUANTILE * deviation, most)),
        noisy_relmse=float((variance * weight).mean()),
        blocks=blocks,
        block_errors=deviations,
        noisy_blocks=_blocks((noise * weight).mean(axis=2))[0],
        denoiser=apply,
    )


def _parts(first: Picture, second: Picture | None) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Independent pictures of the view, and the variance of their mean."""
    pictures = [first] if second is None else [first, second]
    for picture in pictures:
        if picture.spp < 4:
            raise SettingsError(f"the error of a denoised picture needs 4 samples per pixel, not {picture.spp}")
        if picture.findings.get("reconstruction", {}).get("decision") == "used":
            raise SettingsError("a reconstructed picture is denoised already: render with reconstruct=False")
    if second is not None and first.image.shape != second.image.shape:
        raise SettingsError("the pictures differ in size")
    if second is not None and np.array_equal(first.image, second.image):
        raise SettingsError("the pictures are the same: render them with different seeds")
    if second is None or all("even.R" in picture.layers for picture in pictures):
        parts = np.array([half for picture in pictures for half in picture.halves], np.float64)
    else:
        parts = np.array([picture.image for picture in pictures], np.float64)
    if second is None:
        return parts, (parts[0] - parts[1]) ** 2 / 4
    return parts, (first.variance.astype(np.float64) + second.variance) / 4


def _of_four(apply: Callable[[Pixels], Pixels], parts: NDArray[np.float64]) -> NDArray[np.float64]:
    """Squared errors of pictures that are denoised from four parts."""
    of_two = {pair: _applied(apply, parts[list(pair)].mean(axis=0)) for pair in combinations(range(4), 2)}
    squares, step = np.zeros_like(parts[0]), np.zeros_like(parts[0])
    for (i, j), found in of_two.items():
        others = parts[[k for k in range(4) if k not in (i, j)]]
        squares += (found - others[0]) * (found - others[1]) / 6
    for left in range(4):
        three = [k for k in range(4) if k != left]
        found = _applied(apply, parts[three].mean(axis=0))
        for pair in combinations(three, 2):
            step += (of_two[pair] - found) * (of_two[pair] + found - 2 * parts[left]) / 12
    # Errors that fall as the power -3/4 of the parts fall from 3 to 4 parts by 0.55 of their fall from 2 to 3; powers
    # from -1/2 to -1 by 0.59 to 0.5.
    errors: NDArray[np.float64] = squares - 1.55 * step
    return errors


def _weight(
    both: NDArray[np.float64], mean: NDArray[np.float64], variance: NDArray[np.float64]
) -> NDArray[np.float64]:
    """One over the squared picture. A denoiser that changes a place must not change the weight of its error there:
    places that differ from the samples by three standard errors count as these.
    """
    size = np.ones_like(both)
    # The smallest windows last, since they know a place best.
    for side in (17, 5, 1):
        # A pixel where no sample found light has no variance of its own.
        noise = np.sqrt(_box(variance, side) if side > 1 else np.maximum(variance, _box(variance, 5))) / side
        theirs, ours = np.maximum(_box(mean, side), 0), np.maximum(_box(both, side), 1e-30)
        size = np.where(np.abs(ours - theirs) > SURE * noise, theirs / ours, size)
    return _inverse_square(both * size, mean)


def _inverse_square(pixels: NDArray[np.float64], mean: NDArray[np.float64]) -> NDArray[np.float64]:
    """Weights of relMSE for a reference of these pixels."""
    weight: NDArray[np.float64] = 1 / (pixels**2 + 0.01 * mean.mean() ** 2)
    return weight


def _box(image: NDArray[np.float64], side: int) -> NDArray[np.float64]:
    """Means of squares of pixels of odd side."""
    for axis in (0, 1):
        width = [(0, 0)] * 3
        width[axis] = (side // 2 + 1, side // 2)
        sums = np.cumsum(np.pad(image, width, "edge"), axis=axis)
        # The first pixel of the sums lies before the first window.
        after, before = (np.take(sums, np.arange(image.shape[axis]) + at, axis) for at in (side, 0))
        image = (after - before) / side
    return image


def _mean(errors: NDArray[np.float64]) -> tuple[float, float]:
    """Mean of the pixels, and its standard error."""
    pixels = errors.mean(axis=2)
    return float(pixels.mean()), float(pixels.std() / np.sqrt(pixels.size))


def _with_layers(picture: Picture) -> Callable[[Pixels], Pixels]:
    """Open Image Denoise with the layers of a picture."""
    if "albedo.R" not in picture.layers:
        return oidn
    albedo = np.clip(picture.albedo, 0, 1)
    normal = picture.normal if "normal.X" in picture.layers else None
    return lambda image: oidn(image, albedo, normal)


def _applied(denoiser: Callable[[Pixels], Pixels], image: NDArray[Any]) -> NDArray[np.float64]:
    return np.asarray(denoiser(np.asarray(image, np.float32)), np.float64)


def _blocks(pixels: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Means of blocks and their standard errors; blocks at the border are smaller."""
    rows, columns = (-(-side // BLOCK) for side in pixels.shape)
    means, errors = np.empty((rows, columns)), np.empty((rows, columns))
    for row, column in np.ndindex(rows, columns):
        part: NDArray[Any] = pixels[BLOCK * row :, BLOCK * column :][:BLOCK, :BLOCK]
        means[row, column] = part.mean()
        errors[row, column] = part.std() / np.sqrt(part.size)
    return means, errors
