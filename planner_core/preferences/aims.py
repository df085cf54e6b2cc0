"""How near a plan is to each secondary aim, and which images bring it nearer."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from statistics import fmean
from typing import Final

import numpy as np

from planner_core.domain import Preference
from planner_core.problem import COLLECT, CONTACT, Floats
from planner_core.referee.view import View


def value_of(view: View, aim: Preference) -> float:
    """Return how far a plan is from an aim: less is better; 0 if the plan has nothing to measure.

    For ``early``, the age of an image that stays on board is the whole horizon.
    """
    return _VALUES[aim](view)


def _age_s(view: View) -> float:
    if not view.problem.use_resources:
        return 0.0
    ages_s = [
        view.problem.horizon_s if image.age_s is None else image.age_s
        for image in view.timeline.collected.values()
    ]
    return fmean(ages_s) if ages_s else 0.0


def _off_nadir_deg(view: View) -> float:
    off_nadir_deg = view.problem.opportunities.off_nadir_deg[view.image_rows]
    return _mean(off_nadir_deg.astype(np.float64))


def _sun_below_zenith_deg(view: View) -> float:
    elevation_deg = view.problem.opportunities.sun_elevation_deg[view.image_rows]
    return _mean(90.0 - elevation_deg.astype(np.float64))


def _mean(values: Floats) -> float:
    return float(values.mean()) if len(values) else 0.0


def _share_of_busiest(view: View) -> float:
    counts = view.images_by_satellite
    return float(counts.max() / counts.sum()) if counts.sum() else 0.0


def _spent_battery(view: View) -> float:
    lowest = view.timeline.battery_min
    return 0.0 if lowest is None else 1.0 - lowest


def _num_contacts(view: View) -> float:
    return float(len(view.contacts))


_VALUES: Final[Mapping[Preference, Callable[[View], float]]] = {
    "early": _age_s,
    "off_nadir": _off_nadir_deg,
    "sun": _sun_below_zenith_deg,
    "balance": _share_of_busiest,
    "margin": _spent_battery,
    "few_contacts": _num_contacts,
}


def figure_of(aim: Preference, value: float) -> float:
    """Return such a value as people state it: for what should be high, the figure itself.

    >>> figure_of("margin", 0.25)
    0.75
    """
    most = {"sun": 90.0, "margin": 1.0}.get(aim)
    return value if most is None else most - value


def liking_of(view: View, aim: Preference) -> Floats | None:
    """Return how good each collect is for an aim if contacts stay, from -1 to 0 (best).

    None if images make no difference to the aim. Shape ``(n,)``.
    """
    table = view.problem.opportunities
    if aim == "off_nadir":
        return table.off_nadir_deg.astype(np.float64) / -90.0
    if aim == "sun":
        return (table.sun_elevation_deg.astype(np.float64) - 90.0) / 180.0
    if aim == "balance":
        counts = view.images_by_satellite
        shares: Floats = counts[table.satellite] / -float(max(counts.max(initial=0), 1))
        return shares
    if not view.problem.use_resources or aim == "few_contacts":
        return None
    return _of_age(view) if aim == "early" else _of_drain(view)


def _of_age(view: View) -> Floats:
    """Return minus the wait of images for the plan's next contact, as a share of the horizon."""
    table, horizon_s = view.problem.opportunities, view.problem.horizon_s
    liking = np.zeros(len(table))
    actions = view.plan.columns
    contacts = actions.at(table.kind[actions.row] == CONTACT)
    for index, satellite in enumerate(view.problem.satellites):
        starts_s = contacts.start_s[table.satellite[contacts.row] == index]  # in order
        own = satellite.rows[satellite.kind == COLLECT]
        end_s = table.end_s[own]
        next_s = np.append(starts_s, np.inf)[np.searchsorted(starts_s, end_s)]
        liking[own] = -np.minimum((next_s - end_s) / horizon_s, 1.0)
    return liking


def _of_drain(view: View) -> Floats:
    """Return -1 for tasks between the last full level of the lowest battery and its minimum."""
    table = view.problem.opportunities
    liking = np.zeros(len(table))
    lines = view.curves
    lowest = [np.inf if line is None else line.battery.min(initial=np.inf) for line in lines]
    index = int(np.argmin(lowest))
    line = lines[index]
    if line is not None and len(line.time_s):
        at = int(np.argmin(line.battery))
        full = np.flatnonzero(line.battery[:at] >= line.battery.max())
        since_s = line.time_s[full[-1]] if len(full) else 0.0
        own = (table.satellite == index) & (table.start_s >= since_s)
        liking[own & (table.start_s < line.time_s[at])] = -1.0
    return liking
