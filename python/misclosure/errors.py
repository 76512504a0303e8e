"""An exception for each kind of error, with the program's own text.

::

    MisclosureError
    ├── InputError (ValueError)          an argument, an option or a file is not what was expected
    │   ├── BlockError                   the content of a block's file, with file, line and column
    │   ├── ScenarioError                a scenario that cannot be simulated
    │   ├── ModelError                   block and model do not fit together
    │   ├── PluginError                  an effect of a shared library that keeps a law not
    │   └── StartError                   a measurement that the start values cannot predict
    ├── FileError (OSError)              a file that cannot be read or written
    ├── CompilerError                    an effect that does not compile, or no compiler
    ├── AdjustmentError                  the adjustment failed
    │   ├── SingularError                the measurements do not determine every parameter
    │   ├── NotConvergedError            no minimum was found
    │   ├── BlunderError                 blunders bend the adjustment; `result` holds it
    │   └── DisagreementError            the two solvers disagree; `result` holds both
    ├── ResourceError (MemoryError)      too little memory, too few threads
    └── InternalError                    a bug
"""

from __future__ import annotations

from typing import Any


class MisclosureError(Exception):
    """Any error of this package. `code` is the exit code that the program has for it (1 to 4)."""

    def __init__(self, text: str, code: int = 1) -> None:
        super().__init__(text)
        self.code = code
        #: What was computed all the same, of a `BlunderError` or `DisagreementError`.
        self.result: Any = None


class InputError(MisclosureError, ValueError):
    """An argument, an option or a file is not what was expected: says which, where, and what was expected."""


class BlockError(InputError):
    """The content of a block's file is wrong: says file, line, column, and what was expected."""


class ScenarioError(InputError):
    """A scenario that cannot be simulated."""


class ModelError(InputError):
    """Block and model do not fit together."""


class PluginError(InputError):
    """An effect of a shared library that cannot be loaded, or that breaks a law of effects."""


class StartError(InputError):
    """A measurement that the start values cannot predict: behind a camera, outside the domain of an effect."""


class FileError(MisclosureError, OSError):
    """A file that cannot be read or written."""

    def __str__(self) -> str:
        return str(self.args[0])


class CompilerError(MisclosureError):
    """An effect that does not compile, or no compiler."""


class AdjustmentError(MisclosureError):
    """The adjustment failed."""


class SingularError(AdjustmentError):
    """The measurements do not determine every parameter: names the directions without information."""


class NotConvergedError(AdjustmentError):
    """The solver found no minimum."""


class BlunderError(AdjustmentError):
    """Blunders bend the adjustment: what it gives is no result. `result` holds it all the same."""


class DisagreementError(AdjustmentError):
    """The two solvers found different minima. `result` holds both."""


class ResourceError(MisclosureError, MemoryError):
    """Too little memory, or threads that the system does not give."""


class InternalError(MisclosureError):
    """A bug of this package. Please report it with the call that led to it."""
