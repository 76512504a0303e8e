"""Arguments of `Block.from_arrays` as columns of bytes; every refusal names argument, row, column and what was
expected.

What needs the whole block (names that stand twice, measurements beside the sensor) is looked at by the compiled half.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NoReturn, Optional

import numpy as np

from .errors import InputError

INTERIOR = ("f", "ppx", "ppy", "dcx", "dcy", "k1", "k2", "k3", "p1", "p2", "b1", "b2")
KNOWN = {
    "cameras": ("camera", "width_px", "height_px", "pixel_um", *INTERIOR),
    "images": (
        "image",
        "camera",
        "flight",
        "time_s",
        "temperature_c",
        "x",
        "y",
        "z",
        "qw",
        "qx",
        "qy",
        "qz",
        "gnss_x",
        "gnss_y",
        "gnss_z",
        "gnss_sigma_xy",
        "gnss_sigma_z",
        "vx",
        "vy",
        "vz",
        "wx",
        "wy",
        "wz",
        "exposure_s",
        "focus_m",
    ),
    "points": ("point", "x", "y", "z"),
    "ties": ("image", "point", "x", "y", "sigma"),
    "control": ("point", "x", "y", "z", "role", "sigma_xy", "sigma_z"),
    "marks": ("image", "point", "x", "y", "sigma"),
}
#: Rows at most: positions are 32-bit numbers.
MOST_ROWS = 2**32 - 1


def refuse(argument: str, problem: str, row: Optional[int] = None, column: str = "") -> NoReturn:
    """Raises the exception of an argument."""
    place = argument + ("" if row is None else f", row {row}") + (f", column {column}" if column else "")
    raise InputError(f"{place}: {problem}", 2)


class Given:
    """One argument: its columns as numpy arrays of one length."""

    def __init__(self, argument: str, value: Any) -> None:
        self.argument = argument
        self.columns = _columns(argument, value)
        for name in self.columns:
            if name not in KNOWN[argument]:
                refuse(argument, f"no such column; there are {', '.join(KNOWN[argument])}", column=str(name))
        lengths = {name: len(column) for name, column in self.columns.items()}
        if len(set(lengths.values())) > 1:
            refuse(argument, f"expected columns of one length, found {lengths}")
        self.rows = next(iter(lengths.values()), 0)
        if self.rows > MOST_ROWS:
            refuse(argument, f"expected at most {MOST_ROWS} rows, found {self.rows}")

    def __contains__(self, name: str) -> bool:
        return name in self.columns

    def required(self, *names: str) -> None:
        """Refuses an argument without these columns."""
        missing = [name for name in names if name not in self.columns]
        if self.rows and missing:
            refuse(self.argument, f"the column is missing; found {', '.join(self.columns)}", column=missing[0])

    def numbers(self, name: str) -> np.ndarray:
        """A column as f64, shape (rows,)."""
        column = self.columns[name]
        if np.ma.isMaskedArray(column):
            column = np.ma.filled(column.astype(np.float64), np.nan)
        if column.dtype.kind == "O":
            column = np.array([self._number(name, row, value) for row, value in enumerate(column)], np.float64)
        if column.dtype.kind not in "fiu":
            refuse(self.argument, f"expected numbers, found dtype {column.dtype}", column=name)
        return np.ascontiguousarray(column, dtype="<f8")

    def _number(self, name: str, row: int, value: Any) -> float:
        if value is None or type(value).__name__ in ("NAType", "NaTType"):
            return float("nan")
        if isinstance(value, (int, float, np.integer, np.floating)) and not isinstance(value, (bool, np.bool_)):
            try:
                return float(value)
            except OverflowError:
                pass
        refuse(self.argument, f"expected a number, found {_shown(value)}", row, name)

    def counts(self, name: str) -> np.ndarray:
        """A column of whole numbers above zero as u32."""
        column = self.numbers(name)
        wrong = ~((column >= 1) & (column <= MOST_ROWS) & (column == np.floor(column)))
        if wrong.any():
            row = int(np.argmax(wrong))
            refuse(self.argument, f"expected a whole number above zero, found {column[row]}", row, name)
        return column.astype("<u4")

    def texts(self, name: str) -> list[str]:
        """A column of texts."""
        column = self.columns[name]
        if column.dtype.kind not in "OUT":
            refuse(self.argument, f"expected texts, found dtype {column.dtype}", column=name)
        values: list[str] = column.tolist()
        for row, value in enumerate(values):
            if not isinstance(value, str):
                refuse(self.argument, f"expected a text, found {_shown(value)}", row, name)
            try:
                value.encode()
            except UnicodeEncodeError:
                refuse(self.argument, f"expected a text of Unicode characters, found {_shown(value)}", row, name)
        return values

    def is_text(self, name: str) -> bool:
        """Is the column one of names, and not of positions?"""
        return self.columns[name].dtype.kind not in "iu"

    def positions(self, name: str, table: str, names: Mapping[str, int]) -> np.ndarray:
        """A column of names of another table, or of positions in it from 0, as positions (u32)."""
        if self.is_text(name):
            texts = self.texts(name)
            found = [names.get(text, -1) for text in texts]
            positions = np.array(found, np.int64)
            if positions.size and positions.min() < 0:
                row = int(np.argmax(positions < 0))
                refuse(self.argument, f"{_shown(texts[row])} is not in {table}, which has {_few(names)}", row, name)
            return positions.astype("<u4")
        positions = self.columns[name]
        wrong = (positions < 0) | (positions >= len(names))
        if wrong.any():
            row = int(np.argmax(wrong))
            problem = f"{positions[row]} is no row of {table}: expected 0 to {len(names) - 1}"
            refuse(
                self.argument, problem if names else f"{positions[row]} is no row of {table}, which is empty", row, name
            )
        return np.ascontiguousarray(positions, dtype="<u4")


def _shown(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= 60 else text[:57] + "..."


def _few(names: Mapping[str, int]) -> str:
    shown = [repr(name) for _, name in zip(range(5), names)]
    return ", ".join(shown) + (", ..." if len(names) > 5 else "") if shown else "no rows"


def _columns(argument: str, value: Any) -> dict[str, np.ndarray]:
    """The columns of anything that has some."""
    if value is None:
        return {}
    if isinstance(value, np.ndarray):
        if value.dtype.names is None:
            refuse(argument, f"expected named columns, found an array of dtype {value.dtype} and shape {value.shape}")
        named: Mapping[Any, Any] = {name: value[name] for name in value.dtype.names}
    elif isinstance(value, Mapping):
        named = value
    elif hasattr(value, "columns") and hasattr(value, "__getitem__"):
        named = {name: value[name] for name in value.columns}
    elif isinstance(value, Sequence) and not isinstance(value, (str, bytes)):
        for row, record in enumerate(value):
            if not isinstance(record, Mapping):
                refuse(argument, f"expected a dict, found {_shown(record)}", row)
        keys = list(dict.fromkeys(key for record in value for key in record))
        named = {key: [record.get(key) for record in value] for key in keys}
    else:
        problem = "expected a structured array, a DataFrame, a dict of columns or a list of dicts"
        refuse(argument, f"{problem}, found {type(value).__name__}")
    return {name: _column(argument, str(name), column) for name, column in named.items()}


def _column(argument: str, name: str, value: Any) -> np.ndarray:
    if isinstance(value, (str, bytes)) or not hasattr(value, "__len__"):
        refuse(argument, f"expected a column, found {_shown(value)}", column=name)
    try:
        # A list of texts and numbers would become texts.
        column = value if isinstance(value, np.ndarray) else np.asanyarray(value, _object_or_none(value))
    except (ValueError, TypeError, OverflowError) as error:
        refuse(argument, f"expected a column of numbers or texts ({error})", column=name)
    if column.ndim != 1:
        refuse(argument, f"expected shape (rows,), found {column.shape}", column=name)
    return column


def _object_or_none(value: Any) -> Optional[type]:
    if not isinstance(value, (list, tuple)):
        return None
    kinds = {type(own) for own in value}
    plain = kinds <= {int} and all(-(2**63) <= own < 2**63 for own in value)
    return None if kinds <= {str} or kinds <= {float} or plain else object
