"""How close certified plans are to the best, and how fast (``python -m benchmarks.certified``).

Prints, for each size of the paper's mission and its draws, how many plans are proven optimal,
median and greatest CPU seconds, the longest time to a gap within ``NEAR``, and the greatest gap at
the end. Without resources also the CPU seconds of HiGHS on the paper's pairwise program and of
CP-SAT (extra ``peers``, left out if it is not installed) relative to ours. Each solve is one
process on one core, warmed up on a small mission and given ``LIMIT_S`` CPU seconds (CP-SAT:
seconds of the clock); a peer that ran out of time counts with the time it used.

``python -m benchmarks.certified 1000 2000 --families free --draws 3 --alone`` picks sizes, families
and draws, and leaves out the peers; ``--peers pairwise`` leaves out the others.
"""

from __future__ import annotations

import argparse
import importlib.util
import itertools
import json
import statistics
import subprocess
import sys
import time
from collections.abc import Callable, Mapping
from typing import Any, Final

from benchmarks.cpu_budget import CpuBudget
from benchmarks.missions import paper_scenario, problem_of
from planner_core.budget import Budget, Progress
from planner_core.problem import Problem

LIMIT_S = 60.0
NEAR = 0.005  # of the bound
SIZES = (200, 500, 1000, 2000)
WARM_UP = 100  # targets
FAMILIES: Final[Mapping[str, Mapping[str, Any]]] = {
    "free": {"use_resources": False},
    "physical": {"use_resources": True, "dynamics": "physical", "preset": "paper"},
    "paper": {"use_resources": True, "dynamics": "paper", "preset": "paper"},
    "physical-code": {"use_resources": True, "dynamics": "physical", "preset": "paper_code"},
    "paper-code": {"use_resources": True, "dynamics": "paper", "preset": "paper_code"},
}
"""Without resources, and for each dynamics with the rates of the paper's text or of its code."""


def _budget(watch: Callable[[Progress], None] | None = None) -> Budget:
    budget = CpuBudget(LIMIT_S, time.time() + 10.0 * LIMIT_S)
    budget.report = watch or budget.report
    return budget


def certified(problem: Problem) -> dict[str, float]:
    """Return reward and bound of our solver, and when the gap was within ``NEAR``."""
    from planner_core.certified.solver import Certified
    from planner_core.referee.replay import replay

    began, near_s = time.process_time(), []

    def watch(progress: Progress) -> None:
        if progress.bound is None or progress.reward is None:
            return
        if progress.bound - progress.reward <= NEAR * progress.bound:
            near_s.append(time.process_time() - began)

    solution = Certified().solve(problem, _budget(watch), 0)
    assert solution.bound is not None
    reward = replay(problem, solution.plan).reward
    near_s.append(time.process_time() - began)
    return {"reward": reward, "bound": solution.bound, "near_s": near_s[0]}


def pairwise(problem: Problem) -> dict[str, float]:
    """Return reward and bound of HiGHS on the paper's program, with default settings."""
    from planner_core.certified.mip.highs import Engine
    from planner_core.certified.program.model import plan_program

    program = plan_program(problem, "pairwise", 0.0).program
    engine = Engine(program, _budget(), 0, is_chained=False)
    outcome = engine.search(None, 0.0, 0.05, lambda _reward, _bound: None)
    reward = 0.0
    if outcome.columns is not None:
        taken = outcome.columns[: len(problem.opportunities)] > 0.5
        reward = float(problem.worth[taken].sum())
    return {"reward": reward, "bound": outcome.bound}


def groups_of(problem: Problem) -> dict[str, Any]:
    """Return the program for CP-SAT: a group for each set of tasks that exclude each other."""
    from planner_core.certified.program.clique_cuts import clique_cover
    from planner_core.precedence.relation import direct_precedence

    rows, offsets = problem.target_opportunities
    groups = [rows[a:b].tolist() for a, b in itertools.pairwise(offsets)]
    for satellite in problem.satellites:
        offsets, members = clique_cover(direct_precedence(satellite))
        groups += [satellite.rows[members[a:b]].tolist() for a, b in itertools.pairwise(offsets)]
    return {"worth": problem.worth.tolist(), "groups": groups, "limit_s": LIMIT_S}


METHODS = {"certified": certified, "pairwise": pairwise}
PEERS = ("pairwise", "cp_sat")


def one(method: str, family: str, num_targets: int, draw: int) -> dict[str, Any]:
    """Return the result of one solve, after a warm-up."""
    solve = METHODS[method]
    solve(problem_of(paper_scenario(WARM_UP, 99, **FAMILIES[family])))
    problem = problem_of(paper_scenario(num_targets, draw, **FAMILIES[family]))
    began = time.process_time()
    return {**solve(problem), "cpu_s": time.process_time() - began}


def apart(method: str, family: str, num_targets: int, draw: int) -> dict[str, Any]:
    """Return the same from a process of its own: HiGHS and CP-SAT cannot share one."""
    command, program = [sys.executable, "-m"], None
    if method == "cp_sat":
        command += ["benchmarks.cp_sat"]
        problem = problem_of(paper_scenario(num_targets, draw, **FAMILIES[family]))
        program = json.dumps(groups_of(problem))
    else:
        command += ["benchmarks.certified", "--one", method, str(num_targets)]
        command += ["--families", family, "--draw", str(draw)]
    done = subprocess.run(command, input=program, check=True, capture_output=True, text=True)
    answer: dict[str, Any] = json.loads(done.stdout.splitlines()[-1])
    return answer


def print_size(family: str, num_targets: int, num_draws: int, peers: list[str]) -> None:
    """Print one line for each draw and one for the size."""
    times: dict[str, list[float]] = {method: [] for method in ["certified", *peers]}
    gaps, near_s, num_proven = [], [], 0
    for draw in range(num_draws):
        ended = []
        for method in ("certified", *peers):
            answer = apart(method, family, num_targets, draw)
            times[method].append(answer["cpu_s"])
            is_proven = answer["bound"] - answer["reward"] <= 1e-6 * answer["bound"]
            ended.append(f"{method} {answer['reward']:.0f}/{answer['bound']:.1f} "
                         f"{answer['cpu_s']:.2f}s")  # fmt: skip
            if method == "certified":
                num_proven += is_proven
                gaps.append(1.0 - answer["reward"] / answer["bound"])
                near_s.append(answer["near_s"])
        print(f"{'':8}draw {draw}: {', '.join(ended)}", flush=True)
    own = times["certified"]
    ratios = [
        f"{peer} {sum(times[peer]) / sum(own):.1f}x (median {statistics.median(ratio):.1f}x)"
        for peer in peers
        for ratio in [[a / b for a, b in zip(times[peer], own, strict=True)]]
    ]
    print(f"{num_targets:7} {num_proven:3} of {num_draws:2} {statistics.median(own):8.2f} "
          f"{max(own):8.2f} {max(near_s):8.2f} {100 * max(gaps):7.3f}%  {', '.join(ratios)}",
          flush=True)  # fmt: skip


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("sizes", nargs="*", type=int, default=SIZES)
    parser.add_argument("--families", nargs="+", choices=FAMILIES, default=list(FAMILIES))
    parser.add_argument("--draws", type=int, default=10)
    parser.add_argument("--alone", action="store_true")
    parser.add_argument("--peers", nargs="+", choices=PEERS, default=PEERS)
    parser.add_argument("--one", choices=METHODS)
    parser.add_argument("--draw", type=int, default=0)
    options = parser.parse_args()
    if options.one:
        print(json.dumps(one(options.one, options.families[0], options.sizes[0], options.draw)))
        return
    peers = [] if options.alone else list(options.peers)
    if importlib.util.find_spec("ortools") is None and "cp_sat" in peers:
        peers.remove("cp_sat")
    apart("certified", "free", 500, 99)  # compiles what small missions do not need
    for family in options.families:
        print(f"Family {family}")
        print(f"{'targets':>7} {'proven':>9} {'median_s':>8} {'max_s':>8} {'near_s':>8} {'gap':>8}"
              f"{'  time over ours' if family == 'free' else ''}")  # fmt: skip
        for size in options.sizes:
            print_size(family, size, options.draws, peers if family == "free" else [])


if __name__ == "__main__":
    main()
