"""Keyword arguments as the options of the command line, so that both mean the same and refuse with the same words."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from numbers import Integral, Real
from typing import Any, Optional, Union

from .effects import Effect
from .errors import InputError

#: An effect: its id, `id:parameter=start,...`, a pair of id and start values, or an `Effect`.
Term = Union[str, Effect, tuple[Union[str, Effect], Mapping[str, Any]]]


def several(name: str, value: Any) -> list[Any]:
    """One or several as a list."""
    if value is None:
        return []
    if isinstance(value, (str, Effect)) or (
        isinstance(value, tuple) and len(value) == 2 and isinstance(value[1], Mapping)
    ):
        return [value]
    if isinstance(value, Iterable):
        return list(value)
    raise InputError(f"{name}={value!r}: expected one or a list of them", 2)


def term(name: str, value: Term) -> tuple[str, Optional[str]]:
    """`id:parameter=value,...`, and the library of an effect of one's own."""
    values: Mapping[str, Any] = {}
    if isinstance(value, tuple) and len(value) == 2 and isinstance(value[1], Mapping):
        value, values = value
    library = value.library if isinstance(value, Effect) else None
    text = value.id if isinstance(value, Effect) else value
    if not isinstance(text, str):
        raise InputError(f"{name}={value!r}: expected the id of an effect, an Effect, or a pair of one and a dict", 2)
    return with_values(text, values), library


def with_values(text: str, values: Mapping[str, Any]) -> str:
    """`id:key=value,...`; a number has all its digits."""
    settings = [f"{key}={_digits(value)}" for key, value in values.items()]
    return text + (":" + ",".join(settings) if settings else "")


def _digits(value: Any) -> str:
    # Of numpy's numbers, too, which show their type.
    return repr(float(value)) if isinstance(value, Real) and not isinstance(value, Integral) else str(value)


def words(
    *,
    add: Any = None,
    plugins: Any = None,
    free: Any = None,
    fix: Any = None,
    tie: Optional[str] = None,
    datum: Optional[str] = None,
    loss: Optional[str] = None,
    outliers: Optional[str] = None,
    tie_weights: Optional[str] = None,
    solver: Optional[str] = None,
    multistart: bool = False,
    model: Any = None,
    significance: Optional[float] = None,
    tolerance_mm: Optional[float] = None,
    weights_by_flight: bool = False,
) -> list[str]:
    """The words of a command line."""
    line: list[str] = []
    libraries = [str(own.library if isinstance(own, Effect) else own) for own in several("plugins", plugins)]
    for own in several("add", add):
        text, library = term("add", own)
        line.append(f"--add={text}")
        if library is not None and library not in libraries:
            libraries.append(library)
    line += [f"--plugin={library}" for library in libraries]
    for name, value in (("free", free), ("fix", fix)):
        line += [f"--{name}={','.join(map(str, several(name, value)))}"] if value is not None else []
    single = {
        "tie": tie,
        "datum": datum,
        "loss": loss,
        "outliers": outliers,
        "tie-weights": tie_weights,
        "solver": solver,
        "model": model,
        "significance": significance,
        "tolerance-mm": tolerance_mm,
    }
    line += [f"--{name}={value}" for name, value in single.items() if value is not None]
    line += ["--multistart"] if multistart else []
    line += ["--weights-by-flight"] if weights_by_flight else []
    if any("\0" in word for word in line):
        raise InputError("expected options without null characters", 2)
    return line
