"""The paper's published grids (Tables 4, 5) and their outcomes (6, 7)."""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import Final

from benchmarks.paper.settings import PAPER_MCTS, PAPER_SEARCH, Params

TARGETS: Final = (200, 500, 1000, 2000)
GRID_TARGETS: Final = 1000
MCTS_RUNS: Final = 10


@dataclass(frozen=True, slots=True, kw_only=True)
class ForwardRow:
    """A row of Table 6."""

    use_resources: bool
    breadth: int
    gamma: float
    depth: int
    reward: float

    @property
    def tuned(self) -> Params:
        """Return the parameters that the row gives."""
        return {"breadth": self.breadth, "gamma": self.gamma, "depth": self.depth}


@dataclass(frozen=True, slots=True, kw_only=True)
class MctsRow:
    """A row of Table 7."""

    use_resources: bool
    breadth: int
    gamma: float
    depth: int
    exploration: float
    num_simulations: int
    reward: float

    @property
    def tuned(self) -> Params:
        """Return the parameters that the row gives."""
        return {
            "breadth": self.breadth,
            "gamma": self.gamma,
            "depth": self.depth,
            "exploration": self.exploration,
            "num_simulations": self.num_simulations,
        }


TABLE_6: Final = tuple(
    ForwardRow(use_resources=res, breadth=breadth, gamma=gamma, depth=depth, reward=reward)
    for res, breadth, gamma, depth, reward in (
        (False, 3, 0.999, 3, 450.0),
        (False, 4, 0.999, 3, 449.0),
        (False, 5, 0.999, 3, 447.0),
        (True, 3, 0.99, 7, 225.0),
        (True, 4, 0.9925, 3, 223.0),
        (True, 5, 0.995, 3, 221.0),
    )
)

# The headings of Table 7 are swapped: no plan with resources reaches 420, as Table 6 shows.
TABLE_7: Final = tuple(
    MctsRow(use_resources=res, breadth=breadth, gamma=gamma, depth=depth, exploration=c,
            num_simulations=num_simulations, reward=reward)
    for res, breadth, gamma, depth, c, num_simulations, reward in (
        (False, 3, 0.995, 10, 3.0, 500, 420.0),
        (False, 4, 0.995, 10, 5.0, 500, 415.0),
        (False, 5, 0.995, 10, 3.0, 500, 406.0),
        (True, 3, 0.99, 20, 3.0, 200, 215.0),
        (True, 4, 0.99, 20, 3.0, 50, 204.0),
        (True, 5, 0.999, 15, 3.0, 100, 195.0),
    )
)  # fmt: skip


def forward_grid() -> list[Params]:
    """Return the 54 points of Table 4."""
    axes = itertools.product(
        (0.99, 0.9925, 0.995, 0.999, 0.9995, 0.9999), (3, 5, 7), (3, 4, 5)
    )  # fmt: skip
    return [
        {**PAPER_SEARCH, "gamma": gamma, "depth": depth, "breadth": breadth}
        for gamma, depth, breadth in axes
    ]


def mcts_grid() -> list[Params]:
    """Return the 720 points of Table 5."""
    axes = itertools.product(
        (0.99, 0.995, 0.999),
        (5, 10, 15, 20),
        (0.1, 1.0, 3.0, 5.0, 10.0),
        (50, 100, 200, 500),
        (3, 4, 5),
    )
    return [
        {
            **PAPER_MCTS,
            "gamma": gamma,
            "depth": depth,
            "exploration": exploration,
            "num_simulations": num_simulations,
            "breadth": breadth,
        }
        for gamma, depth, exploration, num_simulations, breadth in axes
    ]
