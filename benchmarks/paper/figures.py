"""The paper's figures, three panels each, as CSV and as a picture."""

from __future__ import annotations

import csv
from collections.abc import Iterable, Sequence
from dataclasses import asdict, fields
from pathlib import Path
from typing import Final

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from benchmarks.paper.settings import KINDS, Kind
from benchmarks.paper.summary import Bar, Point

_COLOURS: Final[dict[Kind, str]] = {
    "paper": "#9aa5b1",
    "paper_hard": "#c9b27c",
    "ours": "#2f6f9f",
}
_DPI: Final = 90


def figure_name(num_targets: int, *, res: bool) -> str:
    """Return the name that a figure's files share.

    >>> figure_name(200, res=True)
    'with-resources-200'
    """
    return f"{'with' if res else 'without'}-resources-{num_targets}"


def write_csv(path: Path, columns: Sequence[str], rows: Iterable[Sequence[object]]) -> None:
    """Write a table, numbers with as many digits as anyone can use."""
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(columns)
        writer.writerows([[_brief(value) for value in row] for row in rows])


def _brief(value: object) -> object:
    return f"{value:.6g}" if isinstance(value, float) else value


def write_bars(path: Path, bars: Sequence[Bar]) -> None:
    """Write a figure's numbers."""
    write_csv(path, [f.name for f in fields(Bar)], (list(asdict(bar).values()) for bar in bars))


def write_points(path: Path, points: dict[bool, list[Point]]) -> None:
    """Write a grid's numbers, each family from its best point down."""
    names = sorted({name for ranked in points.values() for p in ranked for name in p.params})
    measured = [f.name for f in fields(Point) if f.name != "params"]
    write_csv(
        path,
        ["use_resources", *names, *measured],
        (
            [res, *(p.params[name] for name in names), *(getattr(p, m) for m in measured)]
            for res, ranked in points.items()
            for p in ranked
        ),
    )


def draw_figure(path: Path, bars: Sequence[Bar], title: str) -> None:
    """Draw reward, runtime and reward per second; the line over each bar is the bound."""
    figure = Figure(figsize=(11.0, 3.9), layout="constrained")
    left, middle, right = figure.subplots(1, 3)
    _panel(left, bars, [bar.reward for bar in bars], "reward")
    for i, bar in enumerate(bars):
        spread = [[bar.reward - bar.reward_min], [bar.reward_max - bar.reward]]
        left.errorbar(i, bar.reward, yerr=spread, color="black", capsize=3, linewidth=1)
        left.hlines(bar.bound, i - 0.45, i + 0.45, color="#b03a2e", linewidth=1.5)
        left.text(i, 0, f"{bar.reward:.0f}", ha="center", va="bottom", fontsize=7, color="white")
    _panel(middle, bars, [bar.seconds for bar in bars], "runtime, CPU s")
    middle.set_yscale("log")
    _panel(right, bars, [bar.reward_per_s for bar in bars], "reward per CPU second")
    right.set_yscale("log")
    kinds = [kind for kind in KINDS if any(bar.kind == kind for bar in bars)]
    handles = [Patch(color=_COLOURS[kind], label=KINDS[kind]) for kind in kinds]
    handles.append(Patch(color="#b03a2e", label="optimum or proven bound"))
    figure.legend(handles=handles, loc="outside lower center", ncols=len(handles), fontsize=8)
    figure.suptitle(title, fontsize=10)
    figure.savefig(path, dpi=_DPI, metadata={"Software": None})


def _panel(axes: Axes, bars: Sequence[Bar], heights: Sequence[float], label: str) -> None:
    axes.bar(range(len(bars)), heights, color=[_COLOURS[bar.kind] for bar in bars])
    names = [bar.solver.replace("_", " ") for bar in bars]
    axes.set_xticks(range(len(bars)), names, rotation=40, ha="right", rotation_mode="anchor")
    axes.tick_params(labelsize=7)
    axes.set_title(label, fontsize=9)
    axes.spines[["top", "right"]].set_visible(False)
