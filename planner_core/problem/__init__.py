"""The frozen problem that solvers and the referee see, and the types it consists of."""

from planner_core.problem.columns import (
    ACCESS_FOUND,
    ACCESS_TOO_SHORT,
    BETWEEN_STARTS,
    COLLECT,
    CONTACT,
    NEVER_VISIBLE,
    OUTSIDE_LIMITS,
    OUTSIDE_TIMES,
    RULED_OUT,
    WRONG_SENSOR_TYPE,
    Bools,
    Bytes,
    Floats,
    Ints,
    Longs,
    Singles,
)
from planner_core.problem.downlink import Downlinks, PassRate, PassRates, StationLinks
from planner_core.problem.pinned import Blocked, Kept, Pinned
from planner_core.problem.problem import (
    Heading,
    ImageOnBoard,
    Opportunities,
    Problem,
    SatelliteProblem,
    Sunlight,
    line_of_sight,
)
from planner_core.problem.ruled_out import RuledOut, RuledOutCollects
from planner_core.problem.satellite import build_satellite_problem
from planner_core.problem.transitions import Transitions, may_follow

__all__ = [
    "ACCESS_FOUND",
    "ACCESS_TOO_SHORT",
    "BETWEEN_STARTS",
    "COLLECT",
    "CONTACT",
    "NEVER_VISIBLE",
    "OUTSIDE_LIMITS",
    "OUTSIDE_TIMES",
    "RULED_OUT",
    "WRONG_SENSOR_TYPE",
    "Blocked",
    "Bools",
    "Bytes",
    "Downlinks",
    "Floats",
    "Heading",
    "ImageOnBoard",
    "Ints",
    "Kept",
    "Longs",
    "Opportunities",
    "PassRate",
    "PassRates",
    "Pinned",
    "Problem",
    "RuledOut",
    "RuledOutCollects",
    "SatelliteProblem",
    "Singles",
    "StationLinks",
    "Sunlight",
    "Transitions",
    "build_satellite_problem",
    "line_of_sight",
    "may_follow",
]
