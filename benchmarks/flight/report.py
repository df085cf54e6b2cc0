"""The printed report of a flight, and when a plan counts as flyable."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

import numpy as np

from benchmarks.flight.judge import Verdict

_MOST_RECORDER_ERROR: Final = 1e-4
_MOST_BELOW_CURVE: Final = 0.03


def lines(verdict: Verdict) -> Iterator[str]:
    """Return a verdict as lines of text."""
    collects = [each for each in verdict.pointing if each.task.mode == "collect"]
    contacts = [each for each in verdict.pointing if each.task.mode == "contact"]
    late_s = [each.late_s for each in collects if not each.throughout]
    on_start = np.mean([each.at_start for each in collects]) if collects else 1.0
    yield f"{verdict.mission.name}: {verdict.mission.duration_s / 3600.0:.2f} h flown"
    yield (f"  collects on target      {verdict.share('collect'):7.2%} of {len(collects)} "
           f"throughout, {on_start:.2%} at the start")  # fmt: skip
    if late_s:
        yield f"  late                    median {np.median(late_s):.1f} s, {max(late_s):.1f} s"
    yield f"  turns longer than gaps  {len(verdict.too_short)}"
    if contacts:
        lowest_deg = min(each.lowest_elevation_deg for each in contacts)
        yield (f"  contacts on station     {verdict.share('contact'):7.2%} of "
               f"{len(contacts)}, lowest elevation {lowest_deg:.3f} deg")  # fmt: skip
    yield (f"  body rate, wheel torque {verdict.rate_share:.2f} and "
           f"{verdict.torque_share:.2f} of their limits")  # fmt: skip
    yield f"  nearest to the sun      {verdict.nearest_sun_deg:.1f} deg"
    told = ", ".join(f"{what} {share:.2f}" for what, share in verdict.incidence.items())
    yield f"  sun on the panels       {told}"
    if verdict.lowest_battery is not None:
        yield (f"  battery                 lowest {verdict.lowest_battery:.3f}, at most "
               f"{verdict.below_curve:.3f} below the timeline's curve")  # fmt: skip
        told = ", ".join(f"{what} {amount:.2f}" for what, amount in verdict.charged.items())
        yield f"  capacities charged      {told}"
    if verdict.recorder_error is not None:
        yield f"  recorder                within {verdict.recorder_error:.1e} of the curve"


def is_flyable(verdict: Verdict, share: float) -> bool:
    """Return whether that share of the collects was on target, and all else as predicted."""
    return (
        verdict.share("collect") >= share
        and verdict.share("contact") == 1.0
        and verdict.nearest_sun_deg >= verdict.mission.agility.sun_exclusion_deg
        and (verdict.recorder_error or 0.0) <= _MOST_RECORDER_ERROR
        and (verdict.below_curve or 0.0) <= _MOST_BELOW_CURVE
    )
