"""Monte Carlo tree search: the solver; its kernels stand beside it."""

from planner_core.solvers.mcts.solver import Mcts

__all__ = ["Mcts"]
