"""Progress of a render on a terminal."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from ._halflight import Progress

#: Seconds before the first line, and between lines.
FIRST, BETWEEN = 0.5, 0.1


def line(progress: Progress) -> str:
    """A progress in one line."""
    parts = [f"{progress.spp} spp"]
    if progress.relmse is not None:
        parts.append(f"relMSE {progress.relmse:.2e}")
    if progress.tiles is not None:
        parts.append(f"{progress.tiles[1]} of {progress.tiles[0]} tiles within the error")
    parts.append(f"{progress.seconds:.0f} s")
    done = ""
    if progress.seconds_left is not None:
        fraction = progress.seconds / max(progress.seconds + progress.seconds_left, 1e-9)
        done = f"{100 * fraction:3.0f} %  "
        parts.append(f"{progress.seconds_left:.0f} s left")
    return done + ", ".join(parts)


class Terminal:
    """A line on standard error, which the next one replaces."""

    def __init__(self) -> None:
        self.start = self.last = time.monotonic()
        self.width = 0

    def __call__(self, progress: Progress) -> None:
        now = time.monotonic()
        if now - self.start < FIRST or now - self.last < BETWEEN:
            return
        self.last = now
        shown = line(progress)
        print("\r" + shown.ljust(self.width), end="", file=sys.stderr, flush=True)
        self.width = len(shown)

    def clear(self) -> None:
        """Removes the line."""
        if self.width:
            print("\r" + " " * self.width + "\r", end="", file=sys.stderr, flush=True)


@contextmanager
def shown(
    progress: Callable[[Progress], object] | bool | None,
) -> Iterator[Callable[[Progress], object] | None]:
    """The callback of a progress: `progress` itself, or a line if it is true, or None on a terminal."""
    if callable(progress):
        yield progress
        return
    if progress is None:
        progress = sys.stderr is not None and sys.stderr.isatty()
    if not progress:
        yield None
        return
    terminal = Terminal()
    try:
        yield terminal
    finally:
        terminal.clear()
