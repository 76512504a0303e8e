"""Pictures."""

from __future__ import annotations

import os
import re
from typing import Union


class Svg(str):
    """A picture as SVG text. A notebook shows it; `save(path)` writes it."""

    def _repr_html_(self) -> str:
        return str(self)

    def __repr__(self) -> str:
        title = re.search("<title>(.*?)</title>", self)
        return f"<Svg {title[1] if title else ''!r}: {len(self)} characters>"

    def save(self, path: Union[str, os.PathLike[str]]) -> None:
        """Writes the text as a file."""
        with open(path, "w", encoding="utf-8") as file:
            file.write(self)
