"""The command `misclosure`: the program itself."""

from __future__ import annotations

import os
import signal
import sys


def main() -> None:
    """Runs the program with this process's command line, and ends the process with its exit code."""
    from . import _native

    # Ctrl-C ends the program at once, as it ends one that is no Python.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    code = _native.program(["misclosure", *sys.argv[1:]])
    sys.stdout.flush()
    # Nothing of Python is left to be ended.
    os._exit(code)


if __name__ == "__main__":
    main()
