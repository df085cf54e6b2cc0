"""Fly a timeline in Basilisk, and print the result.

``python -m benchmarks.flight SCENARIO.json TIMELINE.json`` takes the two files that the demo and
``slewline solve`` write, flies every satellite of them, and prints a table for each. With
``--require 0.995`` the exit status is 1 unless that share of the collects was on target
throughout, every contact on its station, the recorder within 1e-4 of the timeline's curve and the
battery never more than 0.03 below it. Basilisk comes with ``pip install .[flight]``.
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path

from benchmarks.flight.judge import judge
from benchmarks.flight.mission import missions
from benchmarks.flight.reference import Pilot, limits_of
from benchmarks.flight.report import is_flyable, lines


def main() -> None:
    """Run the command line."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.flight", description=__doc__)
    parser.add_argument("scenario", type=Path)
    parser.add_argument("timeline", type=Path)
    parser.add_argument("--hours", type=float, help="from the horizon's start; all by default")
    parser.add_argument("--accel", type=float, metavar="DEG_S2",
                        help="limit to fly with; the plan's own by default")  # fmt: skip
    parser.add_argument("--require", type=float, metavar="SHARE",
                        help="of collects on target throughout, for exit status 0")  # fmt: skip
    options = parser.parse_args()
    try:
        from benchmarks.flight.fly import fly
    except ImportError:
        sys.exit("Basilisk is not installed: pip install 'slewline[flight]', or pip install bsk")
    are_flyable = True
    scenario, timeline = (
        json.loads(path.read_text()) for path in (options.scenario, options.timeline)
    )
    for mission in missions(scenario, timeline, options.hours):
        limits = limits_of(mission.agility, options.accel)
        reference = Pilot(mission, limits).reference()
        verdict = judge(mission, reference, fly(mission, reference, limits))
        print("\n".join(lines(verdict)), flush=True)
        if options.require is not None:
            are_flyable &= is_flyable(verdict, options.require)
    if not are_flyable:
        sys.exit("Not flyable as planned.")


if __name__ == "__main__":
    main()
