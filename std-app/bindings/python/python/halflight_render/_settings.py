"""Settings of a render: the flags of `halflight render` as keywords."""

from __future__ import annotations

import difflib
import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import cache
from typing import TYPE_CHECKING, Any, Literal, TypedDict

import numpy as np
from numpy.typing import ArrayLike

from ._errors import SettingsError
from ._halflight import Progress, keywords

if TYPE_CHECKING:
    from ._scene import Camera

Path = str | os.PathLike[str]


class Settings(TypedDict, total=False):
    """Keywords of `Scene.render`; docs/cli.md describes the flags of these names."""

    # End of the render; the first that holds. Without one: relMSE 1e-3 or 60 s.
    spp: int
    seconds: float | str
    error: float
    # Picture.
    size: tuple[int, int]
    seed: int
    method: str
    camera: Camera | str
    eye: ArrayLike
    look_at: ArrayLike
    up: ArrayLike
    fov: float
    lens: float | tuple[float, float]
    reconstruct: bool | Literal["auto", "off"]
    reference: Any
    # Layers beside the picture: names, or "all". The folder of a report with views of its photon maps.
    layers: str | Sequence[str]
    report: Path
    # Light transport.
    max_depth: int
    caustics: bool | Literal["auto", "off"]
    reuse: bool | Literal["auto"]
    windows: bool | Literal["auto"]
    audit: float | Literal[False]
    cache_metric: str
    cache_error: float
    cache_rays: int
    basis: str
    lobe_error: float
    lobe_degree: int
    photon_kernel: str
    global_photons: int
    caustic_photons: int
    light_paths: int
    connections: int
    merging: bool | Literal["auto"]
    mlt: str
    mutations: int
    path_limit: float
    # Machine.
    threads: int
    memory: int | str
    simd: str
    precise: bool
    # Files.
    checkpoint: Path
    checkpoint_every: float | str
    resume: Path
    shard: str
    load_cache: Path
    save_cache: Path
    # What to call after each round; by default a terminal shows the progress.
    progress: Callable[[Progress], object] | bool | None


#: Keywords with another name than their flag.
RENAMED = {"seconds": "time", "layers": "aov"}

#: Names of settings in other programs.
ELSEWHERE = {"samples": "spp", "sample": "spp", "width": "size", "height": "size", "resolution": "size"}

#: Keywords that are no flags.
OWN = ("reference", "progress")

#: Keywords whose numbers are not separated by commas.
SEPARATORS = {"size": "x"}


@cache
def _names() -> tuple[str, ...]:
    names = {flag: name for name, flag in RENAMED.items()}
    return (*(names.get(flag, flag) for flag in keywords()), *OWN)


def settings() -> list[str]:
    """Names of all settings of a render."""
    return list(_names())


def words(given: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Keywords and values as flags and their text."""
    refuse_unknown(given, _names())
    flags: list[tuple[str, str]] = []
    for name, value in given.items():
        if value is None or name in OWN:
            continue
        if name == "camera" and not isinstance(value, str | int):
            flags += [(key, text(key, part)) for key, part in value.flags().items() if key not in given]
        else:
            flags.append((RENAMED.get(name, name), text(name, value)))
    return flags


def refuse_unknown(given: Iterable[str], known: Sequence[str]) -> None:
    """Refuses names that are no settings, with the nearest one."""
    for name in given:
        if name not in known:
            near = difflib.get_close_matches(name, known, 1, 0.5)
            hint = f"did you mean `{near[0]}`?" if near else f"the settings are {', '.join(known)}"
            meant = names_of(name) if name in RENAMED.values() else ELSEWHERE.get(name)
            if meant in known:
                hint = f"did you mean `{meant}`?"
            raise SettingsError(f"there is no setting `{name}`\n  help: {hint}", help=hint)


def names_of(flag: str) -> str:
    """The keyword of a renamed flag."""
    return next(name for name, other in RENAMED.items() if other == flag)


def text(name: str, value: Any) -> str:
    """The text of a value of the setting `name`."""
    if isinstance(value, bool | np.bool_):
        return "on" if value else "off"
    if isinstance(value, str):
        return value
    if isinstance(value, os.PathLike):
        return str(os.fspath(value))
    if isinstance(value, Sequence | np.ndarray):
        return SEPARATORS.get(name, ",").join(text(name, part) for part in value)
    return str(value)
