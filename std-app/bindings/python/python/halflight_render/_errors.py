"""Errors of halflight, each with the file, the line and the remedy where there are some."""

from __future__ import annotations


class Error(Exception):
    """An error of halflight; its text has the problem and the remedy."""

    #: The file of the problem, or None.
    file: str | None
    #: Its line, from 1, or None.
    line: int | None
    #: The remedy; may be empty.
    help: str

    def __init__(
        self, message: str, file: str | None = None, line: int | None = None, help: str = ""
    ) -> None:
        super().__init__(message)
        self.file, self.line, self.help = file, line, help


class SceneError(Error, ValueError):
    """A scene that cannot be loaded or built."""


class SettingsError(Error, ValueError):
    """A setting or an argument that cannot be used."""


class FileError(Error, OSError):
    """A file that cannot be read or written."""


class MemoryLimitError(Error, MemoryError):
    """Memory that does not suffice."""
