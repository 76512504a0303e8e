"""A block from arrays: defaults, names and positions of every argument."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Optional

import numpy as np

from . import _native
from ._columns import INTERIOR, KNOWN, Given, refuse

if TYPE_CHECKING:
    from .tables import Table

SIGMA = ("tie_px", "mark_px", "control_xy_m", "control_z_m", "gnss_xy_m", "gnss_z_m")


def block_of(
    images: Any, cameras: Any, ties: Any, points: Any, control: Any, marks: Any, sigma: Any, name: str, crs: str
) -> _native.Block:
    """The block of these arguments (see `Block.from_arrays`)."""
    for argument, value in (("name", name), ("crs", crs)):
        if not isinstance(value, str):
            refuse(argument, f"expected a text, found {value!r}")
    given = {
        argument: Given(argument, value)
        for argument, value in (
            ("cameras", cameras),
            ("images", images),
            ("points", points),
            ("ties", ties),
            ("control", control),
            ("marks", marks),
        )
    }
    cameras_ = _cameras(given["cameras"])
    images_ = _images(given["images"], _numbered("cameras", "camera", cameras_["camera"]))
    of_images = _numbered("images", "image", images_["image"])
    points_, numbers = _points(given["points"], given["ties"])
    control_ = _control(given["control"])
    of_control = _numbered("control", "point", control_["point"])
    columns = {
        "cameras": cameras_,
        "images": images_,
        "points": points_,
        "ties": _measurements(given["ties"], of_images, "points", numbers),
        "control": control_,
        "marks": _measurements(given["marks"], of_images, "control", of_control),
    }
    return _native.Block.from_columns(name, crs, _sigma(sigma), columns)


def _sigma(sigma: Any) -> dict[str, float]:
    if sigma is None:
        return {}
    if not isinstance(sigma, Mapping):
        refuse("sigma", f"expected a dict with {', '.join(SIGMA)}, found {type(sigma).__name__}")
    for key, value in sigma.items():
        if key not in SIGMA:
            refuse("sigma", f"{key!r} is unknown; there are {', '.join(SIGMA)}")
        number = isinstance(value, (int, float, np.integer, np.floating)) and not isinstance(value, bool)
        if not number or not (0 < value < float("inf")):
            refuse("sigma", f"{key} = {value!r}: expected a number above zero")
    return {key: float(value) for key, value in sigma.items()}


def _numbered(argument: str, column: str, names: list[str]) -> dict[str, int]:
    numbers = {name: row for row, name in enumerate(names)}
    if len(numbers) < len(names):
        first: dict[str, int] = {}
        for row, name in enumerate(names):
            if first.setdefault(name, row) != row:
                refuse(argument, f"{name!r} stands twice, first in row {first[name]}", row, column)
    return numbers


def _optional(given: Given, taken: tuple[str, ...]) -> dict[str, bytes]:
    names = (name for name in KNOWN[given.argument] if name in given and name not in taken)
    return {name: given.numbers(name).tobytes() for name in names}


def _cameras(given: Given) -> dict[str, Any]:
    if not given.rows:
        refuse("cameras", "expected one at least, with camera, width_px, height_px and f")
    given.required("camera", "width_px", "height_px", "f")
    size = {"width_px": given.counts("width_px"), "height_px": given.counts("height_px")}
    values = {name: given.numbers(name) for name in INTERIOR if name in given}
    values.setdefault("ppx", size["width_px"] / 2)
    values.setdefault("ppy", size["height_px"] / 2)
    values.setdefault("dcx", values["ppx"])
    values.setdefault("dcy", values["ppy"])
    for name in INTERIOR:
        values.setdefault(name, np.zeros(given.rows))
    columns: dict[str, Any] = {"camera": given.texts("camera")}
    columns.update({name: value.tobytes() for name, value in size.items()})
    columns.update({name: np.asarray(value, "<f8").tobytes() for name, value in values.items()})
    columns.update(_optional(given, ("camera", "width_px", "height_px", *INTERIOR)))
    return columns


def _images(given: Given, cameras: dict[str, int]) -> dict[str, Any]:
    if not given.rows:
        refuse("images", "expected one at least, with image, camera, x, y, z, qw, qx, qy, qz")
    given.required("image", "camera", "x", "y", "z", "qw", "qx", "qy", "qz")
    columns: dict[str, Any] = {
        "image": given.texts("image"),
        "camera": given.positions("camera", "cameras", cameras).tobytes(),
        "flight": given.texts("flight") if "flight" in given else ["flight"] * given.rows,
    }
    columns.update(_optional(given, ("image", "camera", "flight")))
    return columns


def _points(given: Given, ties: Given) -> tuple[dict[str, Any], dict[str, int]]:
    """Tie points in the order of `points`, those that `ties` alone names after them."""
    given.required("point")
    names = given.texts("point") if given.rows else []
    numbers = _numbered("points", "point", names)
    places = [given.numbers(axis) if axis in given else np.full(given.rows, np.nan) for axis in ("x", "y", "z")]
    ties.required("image", "point", "x", "y")
    if ties.rows and ties.is_text("point"):
        added = [name for name in dict.fromkeys(ties.texts("point")) if name not in numbers]
    elif ties.rows and not given.rows:
        # Labels of any size.
        labels, positions = np.unique(ties.columns["point"], return_inverse=True)
        added = [str(label) for label in labels.tolist()]
        ties.columns["point"] = positions.reshape(-1)
    else:
        added = []
    numbers.update({name: len(names) + row for row, name in enumerate(added)})
    columns: dict[str, Any] = {"point": names + added}
    for axis, place in zip("xyz", places):
        columns[axis] = np.concatenate([place, np.full(len(added), np.nan)]).astype("<f8").tobytes()
    return columns, numbers


def _measurements(given: Given, images: dict[str, int], table: str, points: dict[str, int]) -> dict[str, Any]:
    if not given.rows:
        return {}
    given.required("image", "point", "x", "y")
    columns: dict[str, Any] = {
        "image": given.positions("image", "images", images).tobytes(),
        "point": given.positions("point", table, points).tobytes(),
    }
    columns.update(_optional(given, ("image", "point")))
    return columns


def _control(given: Given) -> dict[str, Any]:
    if not given.rows:
        return {"point": [], "role": []}
    given.required("point", "x", "y", "z")
    columns: dict[str, Any] = {
        "point": given.texts("point"),
        "role": given.texts("role") if "role" in given else ["control"] * given.rows,
    }
    columns.update(_optional(given, ("point", "role")))
    return columns


def table_of(native: Any, name: str, names: Optional[Mapping[str, list[str]]] = None) -> Table:
    """One of the tables of a block or a result."""
    from .tables import Table

    return Table._unpack(native.table(name), names)
