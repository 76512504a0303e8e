"""Plain arguments, looked at before the compiled half sees them."""

from __future__ import annotations

import os
from typing import Any, Optional

from .errors import InputError


def path(name: str, value: Any) -> str:
    try:
        found = os.fspath(value)
    except TypeError:
        found = None
    if not isinstance(found, str) or not found or "\0" in found:
        raise InputError(f"{name}={value!r}: expected a path", 2)
    return found


def text(name: str, value: Any) -> str:
    if not isinstance(value, str):
        raise InputError(f"{name}={value!r}: expected a text", 2)
    return value


def number(name: str, value: Any) -> float:
    try:
        number = float(value)
    except (TypeError, ValueError, OverflowError):
        number = float("nan")
    if isinstance(value, (str, bytes)) or number != number or number in (float("inf"), float("-inf")):
        raise InputError(f"{name}={value!r}: expected a finite number", 2)
    return number


def seed(value: Any) -> int:
    try:
        seed = int(value.__index__())
    except AttributeError:
        seed = -1
    if not 0 <= seed < 2**64:
        raise InputError(f"seed={value!r}: expected a whole number from 0 to 2^64 - 1", 2)
    return seed


def threads(value: Any) -> Optional[int]:
    if value is None:
        return None
    try:
        threads = int(value.__index__())
    except AttributeError:
        threads = 0
    if not 1 <= threads < 2**31:
        raise InputError(f"threads={value!r}: expected a number above zero, or None", 2)
    return threads
