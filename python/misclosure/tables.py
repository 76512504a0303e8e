"""Tables: numpy structured arrays that pandas understands, and lists of records."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Optional, Union, overload

import numpy as np

Packed = tuple[list[tuple[str, str]], bytes]


class Table(np.ndarray):
    """A numpy structured array, one row per element, one field per column.

    `table["x"]` is a column, shape (rows,); `table[0]` is a row. The data are one read-only copy of what the program
    holds: `table.copy()` can be written to. Unknown numbers are NaN. Columns `image` and `point` of measurements are
    positions (from 0) in the tables of images and points; `to_pandas()` puts the names there.
    """

    _names: dict[str, list[str]]

    @classmethod
    def _unpack(cls, packed: Packed, names: Optional[Mapping[str, list[str]]] = None) -> Table:
        columns, data = packed
        table = np.frombuffer(data, dtype=np.dtype(columns)).view(cls)
        table._names = dict(names or {})
        return table

    def __array_finalize__(self, other: Any) -> None:
        self._names = getattr(other, "_names", {})

    def __reduce__(self) -> Any:
        # Rows alone are pickled by numpy; the names go beside them.
        reduced: Any = super().__reduce__()
        make, arguments, state = reduced
        return _unpickled, (make, arguments, state, self._names)

    @property
    def columns(self) -> tuple[str, ...]:
        """Names of the columns."""
        return tuple(self.dtype.names or ())

    def to_pandas(self) -> Any:
        """A pandas DataFrame, a copy; positions of images and points become their names (categories)."""
        import pandas

        def column(name: str) -> Any:
            values = np.asarray(self[name])
            if name in self._names:
                return pandas.Categorical.from_codes(
                    values.astype(np.int64), categories=pandas.Index(self._names[name])
                )
            return values.astype(object) if values.dtype.kind == "U" else values

        return pandas.DataFrame({name: column(name) for name in self.columns})


def _unpickled(make: Any, arguments: Any, state: Any, names: dict[str, list[str]]) -> Table:
    table: Table = make(*arguments)
    table.__setstate__(state)
    table._names = names
    return table


class Record(Mapping[str, Any]):
    """Named values, as `record["effect"]` or `record.effect`."""

    __slots__ = ("_values",)

    def __init__(self, values: Mapping[str, Any]) -> None:
        object.__setattr__(self, "_values", dict(values))

    def __getitem__(self, name: str) -> Any:
        return _wrapped(self._values[name])

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__") or name == "_values":
            raise AttributeError(name)
        try:
            return self[name]
        except KeyError:
            raise AttributeError(f"no value {name!r}; there are {', '.join(map(str, self))}") from None

    def __setattr__(self, name: str, value: Any) -> None:
        raise AttributeError("a record cannot be changed")

    def __iter__(self) -> Iterator[str]:
        return iter(self._values)

    def __len__(self) -> int:
        return len(self._values)

    def __repr__(self) -> str:
        return f"Record({self._values!r})"

    def __reduce__(self) -> Any:
        return Record, (self._values,)

    def to_dict(self) -> dict[str, Any]:
        """Plain Python values, a copy."""
        import copy

        return copy.deepcopy(self._values)


def _wrapped(value: Any) -> Any:
    return Record(value) if isinstance(value, dict) else value


class Records(Sequence[Record]):
    """Records of one kind, in order."""

    def __init__(self, values: Sequence[Mapping[str, Any]]) -> None:
        self._records = [Record(value) for value in values]

    @overload
    def __getitem__(self, key: int) -> Record: ...
    @overload
    def __getitem__(self, key: slice) -> Records: ...
    def __getitem__(self, key: Union[int, slice]) -> Union[Record, Records]:
        if isinstance(key, slice):
            return Records([record._values for record in self._records[key]])
        return self._records[key]

    def __len__(self) -> int:
        return len(self._records)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Records) and self._records == other._records

    def __repr__(self) -> str:
        return f"Records({[record._values for record in self._records]!r})"

    def to_dicts(self) -> list[dict[str, Any]]:
        """Plain Python values, a copy."""
        return [record.to_dict() for record in self._records]

    def to_pandas(self) -> Any:
        """A pandas DataFrame, one row per record. Values of values stay dicts: `pandas.json_normalize` makes columns of
        `to_dicts()`."""
        import pandas

        return pandas.DataFrame(self.to_dicts())
