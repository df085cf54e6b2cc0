"""Small generated problems: the geometry is drawn at random, everything else is real."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from planner_core.domain import Agility, Dynamics, Resources
from planner_core.problem import (
    ACCESS_FOUND,
    COLLECT,
    CONTACT,
    NEVER_VISIBLE,
    Downlinks,
    Floats,
    Opportunities,
    Problem,
    StationLinks,
    Sunlight,
    build_satellite_problem,
)
from planner_core.problem.sun_turns import SunPath

TIGHT = Resources(
    battery_min_fraction=0.3,
    initial_battery_fraction=0.7,
    sunpoint_charge_per_s=1 / 2500,
    collect_drain_per_s=1 / 300,
    contact_drain_per_s=1 / 1200,
    recorder_max_fraction=0.50037,
    initial_recorder_fraction=0.1,
    collect_fill_per_s=1 / 200,
    downlink_per_s=1 / 250,
    telemetry_per_s=1e-4,
)
"""Resources so scarce that they bind within a handful of tasks."""


@dataclass(frozen=True, kw_only=True)
class Task:
    """One opportunity of a hand-made problem."""

    kind: int
    site: int
    start_s: float
    end_s: float
    satellite: int = 0
    angle_deg: float = 0.0
    margin_s: float = 0.0
    quality: float = 1.0  # of the image
    access: int | None = None  # shared by the collects that one access offers
    turn_deg: float = 0.0  # how far the line of sight turns during the task


def make_problem(
    tasks: Sequence[Task],
    *,
    num_targets: int,
    num_stations: int = 1,
    num_satellites: int = 1,
    horizon_s: float = 1000.0,
    use_resources: bool = True,
    dynamics: Dynamics = "physical",
    resources: Resources = TIGHT,
    agility: Agility = Agility(),  # noqa: B008 - immutable
    rewards: Sequence[float] | None = None,
    sunlight: Sunlight | None = None,
    sun: SunPath | None = None,
    antennas: int = 1,
    downlinks: Downlinks | None = None,
) -> Problem:
    """Return a problem whose lines of sight lie in a plane, at the tasks' angles."""
    ordered = sorted(tasks, key=lambda t: (t.start_s, t.end_s, t.satellite, t.kind, t.site))
    n = len(ordered)

    def column(values: Sequence[float], length: int = n) -> Floats:
        return np.array(values, dtype=np.float64).reshape(length)

    angle = np.radians(column([t.angle_deg for t in ordered]))
    turned = angle + np.radians(column([t.turn_deg for t in ordered]))

    def line_of_sight(angle: Floats) -> Floats:
        return np.column_stack([np.cos(angle), np.sin(angle), np.zeros(n)])

    start_s, end_s = column([t.start_s for t in ordered]), column([t.end_s for t in ordered])
    margin = column([t.margin_s for t in ordered])
    rate = np.zeros((n, 3), dtype=np.float32)
    rate[:, 2] = column([t.turn_deg for t in ordered]) / np.maximum(end_s - start_s, 1e-3)
    table = Opportunities(
        satellite=np.array([t.satellite for t in ordered], dtype=np.int32),
        kind=np.array([t.kind for t in ordered], dtype=np.int8),
        site=np.array([t.site for t in ordered], dtype=np.int32),
        access=np.array(
            [i if t.access is None else n + t.access for i, t in enumerate(ordered)],
            dtype=np.int32,
        ),
        start_s=start_s,
        end_s=end_s,
        access_start_s=start_s - margin,
        access_end_s=end_s + margin,
        los_start=line_of_sight(angle),
        los_end=line_of_sight(turned),
        los_rate_start=rate,
        los_rate_end=rate,
        off_nadir_deg=np.zeros(n, dtype=np.float32),
        elevation_deg=np.full(n, 45.0, dtype=np.float32),
        azimuth_deg=np.zeros(n, dtype=np.float32),
        range_m=np.full(n, 7e5, dtype=np.float32),
        sun_elevation_deg=np.zeros(n, dtype=np.float32),
        in_eclipse=np.zeros(n, dtype=np.bool_),
    )
    links = downlinks or Downlinks(stations=StationLinks.plain(num_stations))
    whole = Sunlight(enter_s=np.array([0.0]), exit_s=np.array([horizon_s]))
    reward = column(rewards if rewards is not None else [1.0] * num_targets, num_targets)
    quality = column([t.quality for t in ordered])
    worth = _worth(table, reward, quality)
    seen = set(table.site[table.kind == COLLECT].tolist())
    return Problem(
        horizon_s=horizon_s,
        use_resources=use_resources,
        dynamics=dynamics,
        continuous_starts=False,
        target_ids=tuple(f"t{i}" for i in range(num_targets)),
        worth=worth,
        target_access=np.array(
            [ACCESS_FOUND if i in seen else NEVER_VISIBLE for i in range(num_targets)],
            dtype=np.int8,
        ),
        station_ids=tuple(f"g{i}" for i in range(num_stations)),
        station_antennas=np.full(num_stations, antennas, dtype=np.int32),
        downlinks=links,
        opportunities=table,
        satellites=tuple(
            build_satellite_problem(
                index,
                table,
                id=f"s{index}",
                name=f"SAT {index}",
                agility=agility,
                resources=resources,
                sunlight=sunlight or whole,
                downlinks=links,
                sun=sun,
            )
            for index in range(num_satellites)
        ),
    )


def with_rewards(problem: Problem, rewards: Sequence[float] | npt.NDArray[np.number]) -> Problem:
    """Return the problem with other target rewards, which all collects of a target earn."""
    reward, n = np.array(rewards, dtype=np.float64), len(problem.opportunities)
    return replace(problem, worth=_worth(problem.opportunities, reward, np.ones(n)))


def _worth(table: Opportunities, reward: Floats, quality: Floats) -> Floats:
    worth = np.zeros(len(table))
    collects = table.kind == COLLECT
    worth[collects] = reward[table.site[collects]] * quality[collects]
    return worth


def random_problem(
    seed: int,
    *,
    num_targets: int = 5,
    num_collects: int = 8,
    num_contacts: int = 2,
    num_satellites: int = 1,
    use_resources: bool = True,
    dynamics: Dynamics = "physical",
    has_rewards: bool = False,
    has_quality: bool = False,
    resources: Resources = TIGHT,
    agility: Agility = Agility(),  # noqa: B008 - immutable
    max_turn_deg: float = 0.0,
    span_s: float = 940.0,
    sunlight: Sunlight | None = None,
    sun: SunPath | None = None,
    num_stations: int = 1,
    num_offers: int = 1,
) -> Problem:
    """Return a small crowded problem drawn from ``seed``.

    Each access offers ``num_offers`` collects, 9 s apart. With ``max_turn_deg`` lines of sight
    turn during collects, by up to that either way. With ``has_quality`` each collect has a
    quality of its own, sometimes 0.
    """
    rng = np.random.default_rng(seed)
    tasks: list[Task] = []
    for access in range(num_collects):
        start_s = round(float(rng.uniform(0, span_s)), 3)
        task = Task(
            kind=COLLECT,
            site=int(rng.integers(num_targets)),
            satellite=int(rng.integers(num_satellites)),
            start_s=start_s,
            end_s=start_s + 30.0,
            angle_deg=float(rng.uniform(-55, 55)),
            turn_deg=float(rng.uniform(-max_turn_deg, max_turn_deg)) if max_turn_deg else 0.0,
            access=access,
        )
        tasks.append(task)
        tasks.extend(
            replace(task, start_s=start_s + 9.0 * k, end_s=start_s + 9.0 * k + 30.0)
            for k in range(1, num_offers)
        )
    for _ in range(num_contacts if use_resources else 0):
        start_s = round(float(rng.uniform(0, 850)), 3)
        tasks.append(
            Task(
                kind=CONTACT,
                site=int(rng.integers(num_stations)) if num_stations > 1 else 0,
                satellite=int(rng.integers(num_satellites)),
                start_s=start_s,
                end_s=start_s + round(float(rng.uniform(40, 140)), 3),
                angle_deg=float(rng.uniform(-60, 60)),
            )
        )
    rewards = [float(r) for r in rng.integers(1, 9, num_targets)] if has_rewards else None
    if has_quality:
        drawn = np.maximum(rng.uniform(-0.1, 1.0, len(tasks)), 0.0)
        tasks = [replace(t, quality=float(q)) for t, q in zip(tasks, drawn, strict=True)]
    return make_problem(
        tasks,
        num_targets=num_targets,
        num_stations=num_stations,
        num_satellites=num_satellites,
        use_resources=use_resources,
        dynamics=dynamics,
        rewards=rewards,
        resources=resources,
        agility=agility,
        sunlight=sunlight,
        sun=sun,
    )


ECLIPSES = Sunlight(enter_s=np.array([0.0, 500.0]), exit_s=np.array([180.0, 760.0]))


def varied_problem(
    seed: int,
    dynamics: Dynamics,
    num_satellites: int = 1,
    *,
    scarce: Resources,
    num_targets: int = 5,
    num_collects: int = 8,
    num_contacts: int = 2,
    has_quality: bool = False,
) -> Problem:
    """Return a problem with resources; rewards, eclipses and scarcity vary with the seed."""
    rng = np.random.default_rng(seed)
    return random_problem(
        seed,
        dynamics=dynamics,
        num_satellites=num_satellites,
        has_rewards=bool(rng.integers(2)),
        has_quality=has_quality,
        sunlight=ECLIPSES if rng.integers(2) else None,
        resources=scarce if rng.integers(3) == 0 else TIGHT,
        num_targets=num_targets,
        num_collects=num_collects,
        num_contacts=num_contacts,
    )


def sunny_problem(
    seed: int,
    *,
    num_satellites: int = 1,
    num_collects: int = 8,
    num_targets: int = 5,
    num_contacts: int = 2,
    is_plain: bool = False,
    is_moving: bool = False,
    use_resources: bool = True,
) -> Problem:
    """Return a problem with turns to the sun; two of three draw power at all times.

    The sun stands in the plane of the lines of sight or above it, 60 to 250 s of slewing away for
    most agilities; batteries allow a few images between visits. With ``is_plain`` all images
    are worth the same; with ``is_moving`` slews begin and end in motion.
    """
    rng = np.random.default_rng(seed)
    angle, height = rng.uniform(0.0, 2.0 * np.pi), rng.uniform(-0.5, 0.5)
    direction = np.array([np.cos(angle), np.sin(angle), height])
    direction /= np.linalg.norm(direction)
    agility = (
        Agility(slew_rate_deg_s=1.5),
        Agility(slew_rate_deg_s=3.0, acceleration_deg_s2=0.2, settle_s=2.0),
        Agility(slew_rate_deg_s=1.0, acceleration_deg_s2=0.05, settle_s=5.0),
    )[int(rng.integers(3))]
    if is_moving:
        acceleration_deg_s2 = agility.acceleration_deg_s2 or 0.3
        agility = replace(agility, slew_model="moving", acceleration_deg_s2=acceleration_deg_s2)
    resources = replace(
        TIGHT,
        sun_pointing="slew",
        panel_angle_deg=float(rng.choice([180.0, 135.0, 90.0, 45.0])),
        idle_drain_per_s=float(rng.choice([0.0, 1e-4, 4e-4])),
        initial_battery_fraction=float(rng.choice([0.5, 0.7, 1.0])),
        sunpoint_charge_per_s=float(rng.choice([1 / 2500, 1 / 1000, 1 / 300])),
        collect_drain_per_s=float(rng.choice([1 / 600, 1 / 300, 1 / 200])),
        recorder_max_fraction=float(rng.choice([0.50037, 0.90037])),
    )
    return random_problem(
        seed,
        num_satellites=num_satellites,
        num_collects=num_collects,
        num_targets=num_targets,
        num_contacts=num_contacts,
        has_rewards=not is_plain and bool(rng.integers(2)),
        use_resources=use_resources,
        resources=resources,
        agility=agility,
        max_turn_deg=15.0,
        sunlight=ECLIPSES if rng.integers(2) else None,
        sun=SunPath(step_s=1000.0, directions=np.array([direction, direction])),
        span_s=float(rng.choice([500.0, 940.0])),
    )
