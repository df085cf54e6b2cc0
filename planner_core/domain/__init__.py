"""The types that planning is about.

Glossary
--------
Target
    A point on the ground that someone wants imaged once.
Access
    A maximal interval in which geometry allows a satellite to see a target or a station.
Opportunity
    A *collect* (image of a target) or a *contact* (pass over a station) that a plan may take.
Plan
    The actions chosen. A *timeline* is the plan replayed by the referee.
Horizon
    The span that is planned; instants inside it are seconds from its start.
Epoch
    The instant an element set is given for.
Reward, quality, worth
    What a perfect image of a target earns; how good an image is, from 0 to 1; their product.
Objective
    How much of its worth an image earns when it is taken, and how much when it is on the ground.
Outage
    A span in which a satellite or a station is unavailable.
State
    What is known of a satellite's battery, recorder, attitude and images before the
    horizon begins.
Pin
    What a plan must contain, or must not; see ``planner_core.pins``.
Off-nadir angle
    At the satellite, between nadir and the line of sight. *Elevation* is measured at the ground.
Slew, settle
    The turn from one line of sight to another, and the wait after it.

Every type is immutable and checks itself when made.
"""

from __future__ import annotations

from planner_core.domain.forecast import Forecast, SkySeries
from planner_core.domain.horizon import Horizon
from planner_core.domain.objective import Objective, Preference
from planner_core.domain.orbit_ephemeris import (
    EphemerisSegment,
    Frame,
    OrbitEphemeris,
)
from planner_core.domain.outages import Outage
from planner_core.domain.quality import Curve, Quality
from planner_core.domain.replan import Flown, Promise, Replan, Stability
from planner_core.domain.scenario import CollectAlignment, Dynamics, Scenario
from planner_core.domain.sites import GroundStation, Target
from planner_core.domain.spacecraft import (
    Agility,
    LookSide,
    Nadir,
    Orbit,
    OrbitDirection,
    OrbitElements,
    Resources,
    Satellite,
    Sensor,
    SlewModel,
    SunPointing,
    mean_elements,
)
from planner_core.domain.states import Attitude, OnBoard, State

__all__ = [
    "Agility",
    "Attitude",
    "CollectAlignment",
    "Curve",
    "Dynamics",
    "EphemerisSegment",
    "Flown",
    "Forecast",
    "Frame",
    "GroundStation",
    "Horizon",
    "LookSide",
    "Nadir",
    "Objective",
    "OnBoard",
    "Orbit",
    "OrbitDirection",
    "OrbitElements",
    "OrbitEphemeris",
    "Outage",
    "Preference",
    "Promise",
    "Quality",
    "Replan",
    "Resources",
    "Satellite",
    "Scenario",
    "Sensor",
    "SkySeries",
    "SlewModel",
    "Stability",
    "State",
    "SunPointing",
    "Target",
    "mean_elements",
]
