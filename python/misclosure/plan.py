"""What a block would show before it is measured."""

from __future__ import annotations

from typing import Any

from .tables import Record, Records


class Plan:
    """The smallest size of each effect that a diagnosis of a block would find with a probability of 80 %."""

    def __init__(self, planned: dict[str, Any]) -> None:
        #: Everything, as `misclosure plan --json` says it.
        self.json = planned

    @property
    def effects(self) -> Records:
        """Effects that the block can show: effect, sizes (see `sizes`), at, absorbed (parameters that it does not
        show), absorbed_typical (see `hidden`), tell. What hides most of the points' error comes first."""
        return Records(self.json["effects"])

    @property
    def sizes(self) -> Records:
        """One record per effect and parameter, for a table: effect, parameter, size (seen from), named_size (named as
        what it is from), looks_like (what it may be called below), unit, size_alone (what size would be if everything
        else were known), plausible (the largest size that is), moves_m (what it does to the points while it is not
        seen, no larger than is plausible, 3D RMS), moves_height_m."""
        own = self.json["effects"]
        return Records([{"effect": one["effect"], **size} for one in own for size in one["sizes"]])

    @property
    def hidden(self) -> Records:
        """Effects that the block cannot show: effect, needs, typical (of each parameter: parameter, size, unit,
        moves_m, moves_height_m: what a size met in practice does to the points; empty where that is not known)."""
        return Records(self.json["hidden"])

    @property
    def precision(self) -> Record:
        """Standard deviations if nothing is wrong: plan_m and height_m of tie points (typical, worst: 95 %),
        plan_limits and height_limits (what 95 % would stay below with cameras known, and with poses known, too; the
        parameter that takes most), parameters."""
        return Record(self.json["precision"])

    def __repr__(self) -> str:
        return f"<Plan of {self.json['block']!r}: {len(self.json['effects'])} effects can be seen>"
