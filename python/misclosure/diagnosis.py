"""A diagnosis."""

from __future__ import annotations

import json
import os
from typing import Any, Union

from . import _native
from .run import Run
from .svg import Svg
from .tables import Records


class Diagnosis:
    """What a diagnosis found. `run` is the adjustment of the model that it hands on."""

    def __init__(self, native: _native.Run) -> None:
        #: The adjustment: of the base model after `diagnose`, of the final one after `improve`.
        self.run = Run(native)
        #: Everything, as `diagnosis.json` has it.
        self.json: dict[str, Any] = json.loads(native.diagnosis() or "{}")

    @classmethod
    def _of(cls, native: _native.Run) -> Diagnosis:
        found = cls(native)
        found.run._raise_failure(found)
        return found

    @property
    def verdict(self) -> str:
        """adequate, missing, unexplained or mistake."""
        return str(self.json["verdict"])

    @property
    def recommended(self) -> list[str]:
        """Ids of the effects that the final model added; of `diagnose`: that are to be added."""
        return list(self.json["recommended"])

    @property
    def causes(self) -> Records:
        """The effects that were found, at the final model: effect, estimate (value, sigma, unit by parameter), drop,
        p_value, size_px, impact, inseparable_from, plausible, words."""
        return Records(self.json["found"])

    @property
    def mistakes(self) -> Records:
        """Mistakes of people: kind, subject, names, value, unit, sentence, remedy."""
        return Records(self.json["mistakes"])

    @property
    def candidates(self) -> Records:
        """Every effect of the catalogue as tested at the base model: effect, rank, p_value, significant, estimate,
        size_px, detectable, ... (keys of `diagnosis.json`)."""
        return Records(self.json["candidates"])

    @property
    def ledger(self) -> Records:
        """One record per model tried: step, added, sigma0, held-out error (px), check points (m), ..."""
        return Records(self.json["ledger"])

    @property
    def structure(self) -> Records:
        """Tests of residual structure at the final model."""
        return Records(self.json["structure"])

    @property
    def left(self) -> list[str]:
        """Unexplained residual patterns, in words."""
        return list(self.json["left"])

    @property
    def text(self) -> str:
        """What the program prints."""
        return self.run.text

    def save(self, folder: Union[str, os.PathLike[str]]) -> None:
        """Writes the folder of the run as the program does, with `diagnosis.json` and the report."""
        self.run.save(folder)

    def figure(self, name: str) -> Svg:
        """A picture of the report (see `Run.figure`)."""
        return self.run.figure(name)

    def _repr_html_(self) -> str:
        return self.run._repr_html_()

    def __repr__(self) -> str:
        named = ", ".join(self.recommended)
        kinds = ", ".join(dict.fromkeys(own["kind"] for own in self.json["mistakes"]))
        parts = [self.verdict, named and f"effects {named}", kinds and f"mistakes {kinds}"]
        return f"<Diagnosis of {self.run.summary['block']!r}: {'; '.join(part for part in parts if part)}>"
