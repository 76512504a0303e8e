"""Adjusts a block of UAV images and names the physical effect that the camera model lacks, or the mistake of a person.

::

    block = misclosure.Block.read("block")            # .from_arrays(...), .from_pycolmap(rec), .simulate("dike")
    found = block.improve()
    found.verdict, found.causes, found.run.residuals

The wheel also brings the program, as the command `misclosure`.
"""

from __future__ import annotations

from . import errors
from ._native import solvers, version as __version__
from .block import Block
from .effects import Effect, effect
from .errors import MisclosureError
from .mistakes import Check, Mended
from .svg import Svg

__all__ = [
    "Block",
    "Check",
    "Covariance",
    "Diagnosis",
    "Effect",
    "Mended",
    "MisclosureError",
    "Plan",
    "Record",
    "Records",
    "Run",
    "Svg",
    "Table",
    "effect",
    "errors",
    "solvers",
]

#: Where names stand that need numpy, which the command does without.
_LATER = {
    "Covariance": "run",
    "Diagnosis": "diagnosis",
    "Plan": "plan",
    "Record": "tables",
    "Records": "tables",
    "Run": "run",
    "Table": "tables",
}


def __getattr__(name: str) -> object:
    if name not in _LATER:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from importlib import import_module

    return getattr(import_module(f".{_LATER[name]}", __name__), name)


def __dir__() -> list[str]:
    return sorted(__all__)
