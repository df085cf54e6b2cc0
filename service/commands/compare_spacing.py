"""``slewline compare-spacing``: what more starts per access gain on the user's own mission."""

from __future__ import annotations

import argparse
import csv
import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final

from planner_core.access.scenario_opportunities import ScenarioOpportunities
from planner_core.budget import Budget
from service.commands.outcome import FAILED, OK
from service.commands.scenario_files import read_object, require_folder, told_of
from service.commands.solve import Search, answer_of
from service.commands.summary import cell
from service.scenarios.translate import quality_from, read_file

SPACINGS_S: Final = (60.0, 30.0, 15.0)
"""Spacings tried by default."""

_HEADER: Final = (
    "starts", "opportunities", "reward", "gain", "bound", "gap", "search_s", "ended", "validity",
)  # fmt: skip
_WIDTHS: Final = (12, 13, 9, 7, 9, 7, 8, 16, 10)


@dataclass(frozen=True, slots=True)
class _Row:
    """The result of a search for one choice of starts."""

    starts: str
    num_opportunities: int
    timeline: Mapping[str, Any]
    is_cancelled: bool

    @property
    def reward(self) -> float:
        return float(self.timeline["totals"]["reward"])

    def with_plan_of(self, other: _Row) -> _Row:
        """Return the row with another one's plan, and its own bound unless that plan earns more."""
        bound = self.timeline["totals"]["bound"]
        if bound is not None and bound < other.reward:
            bound = None
        gap = None if not bound else (bound - other.reward) / bound
        totals = {**self.timeline["totals"], "reward": other.reward, "bound": bound, "gap": gap}
        plan = {name: other.timeline[name] for name in ("satellites", "validity")}
        told = {"totals": totals, "termination": "plan above"}
        return replace(self, timeline={**self.timeline, **plan, **told})

    def cells(self, first: float) -> tuple[str, ...]:
        """Return the cells to print, with the gain over the first row."""
        totals = self.timeline["totals"]
        gain = self.reward / first - 1.0 if first else 0.0
        return (
            self.starts,
            str(self.num_opportunities),
            f"{self.reward:g}",
            f"{gain:+.1%}",
            cell(totals["bound"], "g"),
            cell(totals["gap"], ".1%"),
            f"{self.timeline['runtime_s']['solve']:.1f}",
            self.timeline["termination"],
            self.timeline["validity"],
        )


class _Search(Search):
    """The search for each row."""

    def row(self, starts: str, question: Mapping[str, Any]) -> _Row:
        """Plan a scenario."""
        budget = Budget(self.time_s)
        answer = answer_of(self.request(question), budget)
        assert answer.opportunity_block is not None
        found = ScenarioOpportunities.from_bytes(answer.opportunity_block)
        return _Row(
            starts=starts,
            num_opportunities=len(found.opportunities),
            timeline=json.loads(answer.timeline),
            is_cancelled=budget.is_cancelled,
        )

    def row_from(self, above: _Row, row: _Row, question: Mapping[str, Any]) -> _Row:
        """Return the best of a row, another search from the plan above, and that plan itself.

        The search was too short, since a row with more freedom can also fly the plan above.
        """
        if not question["continuous_starts"]:  # otherwise no search can start from a plan
            replan = {"replan": _from_plan(above, question)}
            again = self.row(row.starts, {**question, **replan})
            row = max(row, again, key=lambda one: one.reward)
        return row if row.reward >= above.reward else row.with_plan_of(above)


def compare_spacing(options: argparse.Namespace) -> int:
    """Plan a scenario file with ever more starts and print each row; return 0 if all are valid.

    The file's own spacing and continuous starts are replaced. With ``quality``, collects cannot
    start anywhere. No row is worse than the one above it: if its search is, another one starts from
    the plan above, and that plan itself counts in any case. Ctrl-C ends the running search and the
    comparison.
    """
    with told_of(options.scenario):
        require_folder(options.out)
        content = read_object(options.scenario)
        has_quality = bool(quality_from(read_file(content).quality))
        search = _Search.of(options)
        rows, all_valid = _table(search, content, options.spacing_s or SPACINGS_S, not has_quality)
        if options.out is not None:
            with options.out.open("w", newline="", encoding="utf-8") as file:
                csv.writer(file).writerows([_HEADER, *rows])
    return OK if all_valid else FAILED


def _table(
    search: _Search, content: dict[str, Any], spacings_s: Sequence[float], anywhere: bool
) -> tuple[list[tuple[str, ...]], bool]:
    """Print the rows as they come; return them, and whether every plan is valid."""
    print(_line(_HEADER))
    rows: list[tuple[str, ...]] = []
    first: float | None = None
    above: _Row | None = None
    all_valid = True
    for starts, change in _variants(spacings_s, anywhere=anywhere):
        row = search.row(starts, content | change)
        if above is not None and not row.is_cancelled and row.reward < above.reward:
            row = search.row_from(above, row, content | change)
        above = row
        first = row.reward if first is None else first
        rows.append(row.cells(first))
        all_valid = all_valid and row.timeline["validity"] == "valid"
        print(_line(rows[-1]), flush=True)
        if row.is_cancelled:
            break
    return rows, all_valid


def _variants(
    spacings_s: Sequence[float], *, anywhere: bool
) -> Iterator[tuple[str, dict[str, Any]]]:
    centred = {"collect_spacing_s": None, "continuous_starts": False}
    yield "one, centred", centred
    for spacing_s in spacings_s:
        yield f"every {spacing_s:g} s", centred | {"collect_spacing_s": spacing_s}
    if anywhere:
        yield "anywhere", centred | {"continuous_starts": True}


def _from_plan(row: _Row, content: Mapping[str, Any]) -> dict[str, Any]:
    """Return the part of a scenario that lets its search start from the plan of another row."""
    actions = [
        {"satellite_id": satellite["id"]}
        | {name: action[name] for name in ("target_id", "station_id", "start") if action[name]}
        for satellite in row.timeline["satellites"]
        for action in satellite["actions"]
        if action["mode"] in ("collect", "contact")
    ]
    return {
        "base": actions,
        "freeze_until": content["horizon"]["start"],
        "stability": {"weight": 0.0, "contact_weight": 0.0},
    }


def _line(cells: Sequence[str]) -> str:
    padded = [cells[0].ljust(_WIDTHS[0]), *map(str.rjust, cells[1:], _WIDTHS[1:])]
    return "  ".join(padded).rstrip()
