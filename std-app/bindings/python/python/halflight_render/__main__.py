"""The command line: `python -m halflight_render`, or `halflight-render`."""

import os
import sys

from ._halflight import program


def main() -> None:
    """Runs the program with the words of the command line, and ends the process with its exit code."""
    code = program(["halflight", *sys.argv[1:]])
    sys.stdout.flush()
    # The program has handlers of signals and threads of its own.
    os._exit(code)


if __name__ == "__main__":
    main()
