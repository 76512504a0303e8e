"""Progress of long work: a callback, tqdm where it is installed, or lines on standard error."""

from __future__ import annotations

import sys
from contextlib import contextmanager
from typing import Callable, Iterator, Optional, Union

from .errors import InputError

#: A callable that gets each step as a text; `True`: tqdm or standard error; `None`, `False`: silent.
Progress = Union[Callable[[str], object], bool, None]


@contextmanager
def reporter(progress: Progress, label: str) -> Iterator[Optional[Callable[[str], object]]]:
    """What the work calls with each step."""
    if progress is None or progress is False:
        yield None
    elif callable(progress):
        yield progress
    elif progress is True:
        try:
            from tqdm.auto import tqdm
        except ImportError:
            yield lambda text: print(f"{label}: {text}", file=sys.stderr)
            return
        with tqdm(desc=label, bar_format="{desc}: {elapsed} {postfix}") as bar:
            yield lambda text: bar.set_postfix_str(text)
    else:
        raise InputError(f"progress={progress!r}: expected a function of one text, True, False or None", 2)
