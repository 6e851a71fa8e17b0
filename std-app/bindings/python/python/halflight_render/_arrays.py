"""Arrays in the layout of the library; those that have it already are not copied."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._errors import SettingsError


def rows64(values: ArrayLike, name: str, columns: int = 3) -> NDArray[np.float64]:
    """Rows of numbers in double precision, shape (n, columns)."""
    return _rows(np.ascontiguousarray(values, np.float64), name, columns)


def rows32(values: ArrayLike, name: str, columns: int = 3) -> NDArray[np.float32]:
    """Rows of numbers in single precision, shape (n, columns)."""
    return _rows(np.ascontiguousarray(values, np.float32), name, columns)


def indices(values: ArrayLike, name: str) -> NDArray[np.uint32]:
    """Rows of three indices."""
    array = np.asarray(values)
    if array.size and array.dtype.kind not in "iu":
        raise SettingsError(f"{name} are of type {array.dtype}; whole numbers are expected")
    if array.size and (array.min() < 0 or array.max() >= 2**32):
        raise SettingsError(f"{name} are indices of 0 and above; one of them is {array.min()} or {array.max()}")
    return _rows(np.ascontiguousarray(array, np.uint32), name, 3)


def picture(values: Any) -> NDArray[np.float32]:
    """A picture, or the array of its pixels, as (rows, columns, 3) in single precision."""
    array = np.ascontiguousarray(getattr(values, "image", values), np.float32)
    if array.ndim != 3 or array.shape[2] != 3:
        raise SettingsError(f"a picture has the shape (rows, columns, 3), not {array.shape}")
    return array


def pixels(values: ArrayLike, name: str, channels: int) -> NDArray[np.uint8] | NDArray[np.float32]:
    """A picture (rows, columns, 3) or (rows, columns), in bytes or single precision, as (rows, columns, 1 or 3)."""
    array = np.asarray(values)
    if array.ndim == 2:
        array = array[:, :, None]
    if array.ndim != 3 or array.shape[2] not in (1, channels) or 0 in array.shape:
        expected = "(rows, columns, 3) or (rows, columns)" if channels == 3 else "(rows, columns)"
        hint = " (opacity is an argument of its own)" if array.ndim == 3 and array.shape[2] == 4 else ""
        raise SettingsError(f"{name} has the shape {np.shape(values)}; {expected} is expected{hint}")
    if array.dtype == np.uint8:
        return np.ascontiguousarray(array)
    if array.dtype.kind not in "fb":
        raise SettingsError(f"{name} is of type {array.dtype}; uint8 or floats are expected")
    return np.ascontiguousarray(array, np.float32)


def triple(values: ArrayLike, name: str) -> tuple[float, float, float]:
    """Three finite numbers; a single number stands for three of it."""
    try:
        array = np.asarray(values, np.float64)
    except (TypeError, ValueError):
        raise SettingsError(f"{name} is {values!r}; three finite numbers are expected") from None
    if array.ndim == 0:
        array = np.full(3, array)
    if array.shape != (3,) or not np.isfinite(array).all():
        raise SettingsError(f"{name} is {values!r}; three finite numbers are expected")
    return float(array[0]), float(array[1]), float(array[2])


def _rows(array: NDArray[Any], name: str, columns: int) -> NDArray[Any]:
    if array.size == 0:
        return array.reshape(0, columns)
    if array.ndim != 2 or array.shape[1] != columns:
        hint = f", as of values.reshape(-1, {columns})" if array.shape[-1:] == (columns,) else ""
        raise SettingsError(f"{name} have the shape {array.shape}; (n, {columns}) is expected{hint}")
    return array
