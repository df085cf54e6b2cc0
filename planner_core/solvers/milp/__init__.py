"""The planning problem as a mixed-integer linear program, solved by HiGHS."""

from planner_core.solvers.milp.solver import Milp

__all__ = ["Milp"]
