"""Mistakes of people: found, and undone."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .block import Block
    from .tables import Records


class Check:
    """What a search for mistakes found."""

    def __init__(self, found: dict[str, Any]) -> None:
        from .tables import Records

        #: Everything, as `misclosure check --json` says it.
        self.json = found
        #: Mistakes of people: kind, subject, names, value, unit, sentence, remedy, mend (edits that undo it).
        self.mistakes: Records = Records(found["mistakes"])

    def __repr__(self) -> str:
        kinds = ", ".join(f"{own['kind']} of {own['subject']}" for own in self.json["mistakes"])
        return f"<Check: {kinds or 'no mistake found'}>"


class Mended:
    """A block in which mistakes are undone."""

    def __init__(self, block: Block, report: dict[str, Any]) -> None:
        from .tables import Records

        #: The mended block; the same as before where nothing was undone.
        self.block = block
        #: Mistakes that were undone, in this order.
        self.mended: Records = Records(report["mended"])
        #: Mistakes that need a person.
        self.left: Records = Records(report["left"])

    def __repr__(self) -> str:
        return f"<Mended: {len(self.mended)} mistakes undone, {len(self.left)} left>"
