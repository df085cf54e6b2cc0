"""What a plan should earn: images taken, images on the ground, and how soon."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal, Self, get_args

from planner_core.domain.checks import require

Preference = Literal["early", "off_nadir", "sun", "balance", "margin", "few_contacts"]
"""A secondary aim: least mean age, least mean off-nadir angle, highest mean sun elevation, least
share of the busiest satellite, highest minimum battery level, fewest contacts."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Objective:
    """How much of its worth an image earns at which time; see ``planner_core.worth``.

    Attributes
    ----------
    collected_share
        The part that an image earns when it is taken, 0 to 1. The rest it earns when its last bit
        is on the ground, first in, first out.
    half_life_s
        The rest halves with every half-life between the end of the collect and that instant; None
        for no decay.
    prefer
        Secondary aims, in order, which decide between plans of the same worth.
    """

    collected_share: float = 1.0
    half_life_s: float | None = None
    prefer: tuple[Preference, ...] = ()

    def __post_init__(self) -> None:
        require(
            0.0 <= self.collected_share <= 1.0, "objective/collected_share", "must be from 0 to 1"
        )
        require(
            self.half_life_s is None or 0.0 < self.half_life_s < math.inf,
            "objective/half_life_s",
            "must be greater than 0, or null for no decay",
        )
        is_known = all(aim in get_args(Preference) for aim in self.prefer)
        require(is_known, "objective/prefer", f"may contain only {', '.join(get_args(Preference))}")
        is_once = len(set(self.prefer)) == len(self.prefer)
        require(is_once, "objective/prefer", "must name each aim at most once")

    @classmethod
    def collected(cls) -> Self:
        """Return the paper's objective: an image earns all of its worth when it is taken."""
        return cls()

    @classmethod
    def delivered(cls) -> Self:
        """Return the objective under which images earn nothing until they are on the ground."""
        return cls(collected_share=0.0)

    @property
    def counts_delivery(self) -> bool:
        """Whether it matters what becomes of an image after it is taken."""
        return self.collected_share < 1.0

    @property
    def is_delivered(self) -> bool:
        """Whether an image earns all on the ground, however late, and nothing on board."""
        return self.collected_share == 0.0 and self.half_life_s is None
