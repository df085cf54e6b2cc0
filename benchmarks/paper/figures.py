"""The paper's figures, three panels each, as CSV and as a picture."""

from __future__ import annotations

import csv
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import asdict, fields
from pathlib import Path
from typing import Final

from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from benchmarks.paper.settings import KINDS, Kind
from benchmarks.paper.summary import Bar, Point

# Distinguishable with colour vision deficiency and in print (Okabe and Ito).
_COLOURS: Final[dict[Kind, str]] = {
    "paper": "#999999",
    "paper_hard": "#e69f00",
    "ours": "#0072b2",
}
_ACRONYMS: Final = ("milp", "mcts")
_DPI: Final = 80
_GROUP: Final = 0.84  # share of the width for a method; the rest separates it from the next


def figure_name(num_targets: int, *, res: bool) -> str:
    """Return the common name of a figure's files.

    >>> figure_name(200, res=True)
    'with-resources-200'
    """
    return f"{'with' if res else 'without'}-resources-{num_targets}"


def method_name(solver: str) -> str:
    """Return a method's name on the page.

    >>> method_name("forward_search"), method_name("milp")
    ('forward search', 'MILP')
    """
    return solver.upper() if solver in _ACRONYMS else solver.replace("_", " ")


def write_csv(path: Path, columns: Sequence[str], rows: Iterable[Sequence[object]]) -> None:
    """Write a table, numbers with as many digits as are useful."""
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
    """Draw reward, runtime and reward per second, each method's settings side by side."""
    figure = Figure(figsize=(13.0, 4.2), layout="constrained")
    left, middle, right = figure.subplots(1, 3)
    kinds = [kind for kind in KINDS if any(bar.kind == kind for bar in bars)]
    handles: list[Artist] = [Patch(color=_COLOURS[kind], label=KINDS[kind]) for kind in kinds]
    handles += _rewards(left, bars)
    _panel(middle, bars, [bar.seconds for bar in bars], "runtime, CPU s")
    _panel(right, bars, [bar.reward_per_s for bar in bars], "reward per CPU second")
    for axes in (middle, right):
        axes.set_yscale("log")
        axes.grid(axis="y", color="#dddddd", linewidth=0.6)
        axes.set_axisbelow(True)
    figure.legend(handles=handles, loc="outside lower center", ncols=len(handles), fontsize=9)
    figure.suptitle(title, fontsize=11)
    figure.savefig(path, dpi=_DPI, metadata={"Software": None})


def _rewards(axes: Axes, bars: Sequence[Bar]) -> list[Artist]:
    """Draw the first panel with the bound across it; return the entries of its legend."""
    _panel(axes, bars, [bar.reward for bar in bars], "reward")
    whole = max(bars, key=lambda bar: bar.draws)
    axes.set_ylim(0.0, 1.06 * whole.bound)
    is_optimum = whole.proven == whole.draws
    label = f"{'optimum, proven' if is_optimum else 'proven bound'}: {whole.bound:.1f}"
    shown: list[Artist] = [axes.axhline(whole.bound, color="black", linestyle="--", label=label)]
    for x, bar in zip(_centres(bars), bars, strict=True):
        spread = [[bar.reward - bar.reward_min], [bar.reward_max - bar.reward]]
        if bar.draws > 1:
            axes.errorbar(x, bar.reward, yerr=spread, color="black", capsize=2, linewidth=1)
        axes.text(
            x, 0.02 * whole.bound, f"{bar.reward:.0f}", ha="center", va="bottom", fontsize=8,
            rotation=90, color="white" if bar.kind == "ours" else "black",
        )  # fmt: skip
    broken = [(x, b.images) for x, b in zip(_centres(bars), bars, strict=True) if b.violations]
    if broken:
        xs, images = zip(*broken, strict=True)
        label = "images, broken rules forgiven"
        shown += axes.plot(xs, images, "o", color="black", mfc="white", ms=4, label=label)
    return shown


def _centres(bars: Sequence[Bar]) -> list[float]:
    """Return the position of each bar: methods at whole numbers, their settings around them."""
    methods = list(dict.fromkeys(bar.solver for bar in bars))
    centres = []
    for bar in bars:
        kinds = [other.kind for other in bars if other.solver == bar.solver]
        shift = kinds.index(bar.kind) - (len(kinds) - 1) / 2
        centres.append(methods.index(bar.solver) + shift * _width(bars))
    return centres


def _width(bars: Sequence[Bar]) -> float:
    return _GROUP / max(Counter(bar.solver for bar in bars).values())


def _panel(axes: Axes, bars: Sequence[Bar], heights: Sequence[float], label: str) -> None:
    colours = [_COLOURS[bar.kind] for bar in bars]
    axes.bar(_centres(bars), heights, width=0.94 * _width(bars), color=colours)
    methods = list(dict.fromkeys(bar.solver for bar in bars))
    names = [method_name(name).replace(" ", "\n") for name in methods]
    axes.set_xticks(range(len(methods)), names)
    axes.tick_params(labelsize=9)
    axes.set_title(label, fontsize=10)
    axes.spines[["top", "right"]].set_visible(False)
