"""The named settings that the study compares: the paper's, and our defaults."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final, Literal

from planner_core.solvers.base import Solver
from planner_core.solvers.registry import SOLVERS, solver_class

Kind = Literal["paper", "paper_hard", "ours"]
Params = Mapping[str, Any]

KINDS: Final[Mapping[Kind, str]] = {
    "paper": "the paper's setting",
    "paper_hard": "the same, hard limits",
    "ours": "Slewline's defaults",
}

PAPER_SEARCH: Final[Params] = {
    "unimaged_only": False,
    "window_moves_per_task": 0.0,
    "contact_reward_per_s": 0.1,
    "sunpoint_reward_per_s": 1e-4,
    "penalty": 1e4,
    "feasibility": "penalty",
    "contact_above_fraction": 0.0,
}
"""Parameters that forward search and MCTS share in the paper (Table 2)."""

PAPER_FORWARD: Final[Params] = {**PAPER_SEARCH, "gamma": 0.999, "depth": 3, "breadth": 3}

PAPER_MCTS: Final[Params] = {
    **PAPER_SEARCH,
    "breadth": 3,
    "exploration": 3.0,
    "discount": "per_second",
    "returns": "with_reward",
    "backup": "mean",
    "rollout": "random",
    "keep_incumbent": False,
}
"""Without those that Table 7 tunes."""

MCTS_TUNED: Final[Mapping[bool, Params]] = {
    False: {"num_simulations": 500, "depth": 10, "gamma": 0.995},
    True: {"num_simulations": 200, "depth": 20, "gamma": 0.99},
}
"""The best row of Table 7, by whether resources count (the table's labels are swapped)."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Setting:
    """A solver with parameters; omitted ones keep their defaults."""

    kind: Kind
    solver: str
    params: Params

    def make(self) -> Solver:
        """Return the solver."""
        return make_solver(self.solver, self.params)


def make_solver(name: str, params: Params) -> Solver:
    """Return a solver by its name in the API, with these parameters."""
    return solver_class(name)(**params)


def as_text(params: Params) -> str:
    """Return parameters as one line, equal for equal parameters.

    >>> as_text({"depth": 3, "breadth": 4})
    '{"breadth": 4, "depth": 3}'
    """
    return json.dumps(dict(params), sort_keys=True)


def settings(*, use_resources: bool) -> tuple[Setting, ...]:
    """Return every setting of one problem family, in the order of the figures.

    Graph search and integer programming knew no resources in the paper.
    """
    rule = {"unimaged_only": False, "contact_above_fraction": 0.0, "feasibility": "penalty"}
    mcts = {**PAPER_MCTS, **MCTS_TUNED[use_resources]}
    found = [Setting(kind="paper", solver="rule", params=rule)]
    if not use_resources:
        listing = {"path": "longest", "feasibility": "penalty"}
        found.append(Setting(kind="paper", solver="graph", params=listing))
        found.append(Setting(kind="paper", solver="milp", params={"formulation": "pairwise"}))
    found += [
        Setting(kind="paper", solver="forward_search", params=PAPER_FORWARD),
        Setting(kind="paper", solver="mcts", params=mcts),
    ]
    if use_resources:
        found += [_hardened(setting) for setting in found]
    found += [Setting(kind="ours", solver=name, params={}) for name in SOLVERS]
    return tuple(found)


def _hardened(setting: Setting) -> Setting:
    params = {**setting.params, "feasibility": "hard"}
    return Setting(kind="paper_hard", solver=setting.solver, params=params)
