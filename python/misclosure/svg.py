"""Pictures."""

from __future__ import annotations

import os
from typing import Union


class Svg(str):
    """A picture as SVG text. A notebook shows it; `save(path)` writes it."""

    def _repr_html_(self) -> str:
        return str(self)

    def save(self, path: Union[str, os.PathLike[str]]) -> None:
        """Writes the text as a file."""
        with open(path, "w", encoding="utf-8") as file:
            file.write(self)
