"""Plans with a proof: a plan and a bound that close in on each other."""

from planner_core.solvers.certified.solver import Certified

__all__ = ["Certified"]
