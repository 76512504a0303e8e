"""Effects of one's own, from a formula."""

from __future__ import annotations

import json
import os
import tempfile
from collections.abc import Mapping
from typing import Any, Optional, Union

from . import _native
from .errors import InputError, PluginError

_folder: Optional[tempfile.TemporaryDirectory[str]] = None


class Effect:
    """An effect in a shared library: goes into `add` and `plugins` of `Block.adjust`, `diagnose`, `improve`,
    `inject`."""

    def __init__(self, library: Union[str, os.PathLike[str]], header: str = "") -> None:
        #: Path of the library.
        self.library = os.fspath(library)
        #: The C++ header that it was made of.
        self.header = header
        #: Which laws of effects it keeps, as `misclosure effects check --json` says it.
        self.checked: dict[str, Any] = json.loads(_native.check_effect(self.library))

    @property
    def id(self) -> str:
        """Its id."""
        return str(self.checked["effect"])

    @property
    def stage(self) -> str:
        """Where in the chain it acts."""
        return str(self.checked["stage"])

    def __repr__(self) -> str:
        return f"<Effect {self.id!r} of the {self.stage} stage>"


def effect(
    name: str,
    *,
    stage: str,
    parameters: Mapping[str, Any],
    folder: Optional[Union[str, os.PathLike[str]]] = None,
    **formula: Union[str, float],
) -> Effect:
    """An effect from its formula: writes the C++ header, compiles it with the system's compiler and checks every law.

    ::

        ripple = misclosure.effect("ripple", stage="image", dx="a*sin(2*pi*x/p)", dy="0",
                                   parameters={"a": {"unit": "px", "typical": 0.2}, "p": {"unit": "px", "given": 300}})
        found = block.improve(plugins=[ripple])

    - `stage`: image, interior, exposure, ray, position, control or frame
    - `dx`, `dy`, ...: what the effect adds to a value of the stage (image: x, y in px; interior: f, ppx, ...; ray,
      position, control, frame: X, Y, Z in m; exposure: r1, r2, r3, X, Y, Z). Operators are `+ - * / ^`, functions those
      of C++. Names are the stage's values, the parameters, and what is recorded (t, tau, T, vx, vy, vz, w, h,
      row, column)
    - `parameters`: by name, estimated ones as `{"unit", "typical", "most"}` (nothing happens at zero), given ones as
      `{"unit", "given"}`; a number alone is a typical size
    - `folder`: where header and library go; without it they last as long as this process

    It needs a C++ compiler and Ceres' headers (`libceres-dev`). Raises `CompilerError` without them, `PluginError`
    where a law is broken.
    """
    if not isinstance(name, str):
        raise InputError(f"name={name!r}: expected a text", 2)
    equations = [(output, _expression(output, text)) for output, text in formula.items()]
    header = _native.effect_header(name, str(stage), equations, [_declared(*own) for own in _pairs(parameters)])
    place = _own_folder(name) if folder is None else os.fspath(folder)
    os.makedirs(place, exist_ok=True)
    source, library = os.path.join(place, f"{name}.h"), os.path.join(place, f"{name}.so")
    with open(source, "w", encoding="utf-8") as file:
        file.write(header)
    _native.build_effect(source, library)
    made = Effect(library, header)
    broken = [law for law in made.checked["laws"] if not law["holds"]]
    if broken:
        what = "; ".join(f"{law['law']}: {law['found']}" for law in broken)
        raise PluginError(f"{library}: effect `{name}` breaks {what}", 2)
    return made


def _own_folder(name: str) -> str:
    global _folder
    if _folder is None:
        _folder = tempfile.TemporaryDirectory(prefix="misclosure-effects-")
    # A library that is loaded is never written again.
    return tempfile.mkdtemp(prefix=f"{name}-", dir=_folder.name)


def _expression(output: str, text: Any) -> str:
    if isinstance(text, (int, float)) and not isinstance(text, bool):
        return repr(text)
    if not isinstance(text, str):
        raise InputError(f"{output}={text!r}: expected an expression", 2)
    return text


def _pairs(parameters: Any) -> list[tuple[Any, Any]]:
    if not isinstance(parameters, Mapping):
        raise InputError(f"parameters={parameters!r}: expected a dict by name", 2)
    return list(parameters.items())


def _declared(name: Any, own: Any) -> tuple[str, str, Optional[float], Optional[float], Optional[float]]:
    values = own if isinstance(own, Mapping) else {"typical": own}
    for key in values:
        if key not in ("unit", "given", "typical", "most"):
            raise InputError(f"parameters, {name}: {key!r} is unknown; there are unit, typical, most, given", 2)

    def number(key: str) -> Optional[float]:
        value = values.get(key)
        if value is not None and (isinstance(value, bool) or not isinstance(value, (int, float))):
            raise InputError(f"parameters, {name}: {key}={value!r}: expected a number", 2)
        return None if value is None else float(value)

    return str(name), str(values.get("unit", "1")), number("given"), number("typical"), number("most")
