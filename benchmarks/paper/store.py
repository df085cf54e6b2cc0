"""Finished runs in a CSV file that grows by one line each, so that no run is repeated."""

from __future__ import annotations

import csv
import hashlib
import io
from collections.abc import Iterable
from dataclasses import asdict, fields
from pathlib import Path
from typing import Final, cast

import planner_core
from benchmarks.paper.measure import Outcome, Task
from benchmarks.paper.readings import Reading
from planner_core.domain import Dynamics

_READING: Final = ("look_min_deg", "look_max_deg", "rates", "dynamics")
_TASK: Final = tuple(f.name for f in fields(Task) if f.name != "reading")
_OUTCOME: Final = tuple(f.name for f in fields(Outcome))
COLUMNS: Final = (*_READING, *_TASK, *_OUTCOME)


def code_id() -> str:
    """Return a short hash of the planning core: results of a different core do not count."""
    digest = hashlib.sha256()
    root = Path(planner_core.__file__).parent
    for path in sorted(root.rglob("*.py")):
        digest.update(path.relative_to(root).as_posix().encode() + b"\0" + path.read_bytes())
    return digest.hexdigest()[:12]


class Store:
    """Finished runs, by task; ``add`` writes each to disk at once."""

    def __init__(self, path: Path):
        self._path = path
        self.done: dict[Task, Outcome] = {}
        path.parent.mkdir(parents=True, exist_ok=True)
        text = path.read_text(encoding="utf-8") if path.exists() else ""
        # A killed run may have left an incomplete line.
        whole = text[: text.rfind("\n") + 1]
        head = ",".join(COLUMNS) + "\n"
        if not whole.startswith(head):
            whole = head
        if whole != text:
            path.write_text(whole, encoding="utf-8")
        for line in csv.DictReader(io.StringIO(whole)):
            task, outcome = _read(line)
            self.done[task] = outcome

    def add(self, task: Task, outcome: Outcome) -> None:
        """Keep one finished run."""
        self.done[task] = outcome
        line = io.StringIO()
        csv.writer(line, lineterminator="\n").writerow(_row(task, outcome))
        with self._path.open("a", encoding="utf-8") as file:
            file.write(line.getvalue())

    def minutes_in_all(self, took_min: float) -> float:
        """Record the minutes of one more call and return those of all that filled this store."""
        path = self._path.with_suffix(".minutes")
        before = float(path.read_text(encoding="utf-8")) if path.exists() else 0.0
        path.write_text(f"{before + took_min:.3f}", encoding="utf-8")
        return before + took_min

    def missing(self, tasks: Iterable[Task]) -> list[Task]:
        """Return those of ``tasks`` that are still to be run, in their order."""
        return [task for task in dict.fromkeys(tasks) if task not in self.done]


def _row(task: Task, outcome: Outcome) -> list[object]:
    reading = task.reading
    own, judged = {n: getattr(task, n) for n in _TASK}, asdict(outcome)
    return [*reading.look_deg, reading.rates, reading.dynamics, *own.values(), *judged.values()]


def _read(line: dict[str, str]) -> tuple[Task, Outcome]:
    reading = Reading(
        look_deg=(float(line["look_min_deg"]), float(line["look_max_deg"])),
        rates=line["rates"],
        dynamics=cast(Dynamics, line["dynamics"]),
    )
    task = Task(
        reading=reading,
        use_resources=line["use_resources"] == "True",
        num_targets=int(line["num_targets"]),
        draw=int(line["draw"]),
        solver=line["solver"],
        params=line["params"],
        seed=int(line["seed"]),
        limit_s=float(line["limit_s"]),
    )
    outcome = Outcome(
        reward=float(line["reward"]),
        images=int(line["images"]),
        violations=int(line["violations"]),
        repeats=int(line["repeats"]),
        bound=float(line["bound"]),
        seconds=float(line["seconds"]),
        cost_s=float(line["cost_s"]),
        termination=line["termination"],
    )
    return task, outcome
