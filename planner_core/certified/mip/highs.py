"""HiGHS, run on a program under a budget: quiet, single-threaded and repeatable."""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import dataclass

import highspy
import numpy as np

from planner_core.budget import Budget
from planner_core.certified.program.linear_program import Program, Rows
from planner_core.certified.sizes import LARGE_PROGRAM, LOG_CHARACTERS, PAUSE_S, POLL_S
from planner_core.certified.tolerances import CHAINED, NEARLY, NOTHING, SAME
from planner_core.problem import Floats, Ints

# HiGHS's usual tolerance suits sums of zeros and ones. In a long chain of levels each row may be
# off by that much, so there it must be far below one task.


Watch = Callable[[float, float], None]
"""Called repeatedly with the best objective so far and the bound."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Outcome:
    """The result of a run.

    Attributes
    ----------
    columns
        The best integer point found, or None. Shape ``(num_columns,)``.
    bound
        No point is worth more; infinite if nothing is known yet.
    is_infeasible
        Whether it is proven that there is no point at all.
    log
        The end of HiGHS's log.
    """

    columns: Floats | None
    bound: float
    is_infeasible: bool
    log: str


class Engine:
    """One program in HiGHS: relaxations first, then the integer search.

    HiGHS runs in its own thread. Once the budget is spent it stops at its next callback, for which
    callers wait only briefly. If that does not suffice, the run is abandoned and never touched
    again, and its thread ends at that callback.

    Attributes
    ----------
    columns, gains
        The last corner of the relaxation, and what it would gain per unit more of each column
        (below 0 if that would lose); 0 as long as none was found. Shape ``(num_columns,)``.
    row_multipliers
        Those of the rows at that corner, as ``Program.dual_value`` takes them.
    """

    def __init__(self, program: Program, budget: Budget, seed: int, *, is_chained: bool) -> None:
        tolerance = CHAINED if is_chained else SAME
        self._budget = budget
        self._bound = float("inf")
        self._incumbent: Floats | None = None
        self.columns, self.gains = np.zeros((2, program.num_columns))
        self.row_multipliers = np.zeros(program.num_rows)
        self._is_abandoned = False
        self._messages: list[str] = []
        self._highs = highs = highspy.Highs()  # type: ignore[no-untyped-call]  # it has no types
        options: dict[str, bool | int | float | str] = {
            "output_flag": True,
            "log_to_console": False,
            # More threads would outlive the solve, and workers fork.
            "threads": 1,
            "parallel": "off",
            "random_seed": seed % 2**31,
            "primal_feasibility_tolerance": tolerance,
            "mip_feasibility_tolerance": tolerance,
        }
        for option, value in options.items():
            highs.setOptionValue(option, value)
        self._num_columns = n = program.num_columns
        self._is_integer = np.concatenate(program.is_integer)
        highs.addVars(n, np.concatenate(program.lower), np.concatenate(program.upper))
        worth, self._left_out = _noticeable(program)
        highs.changeColsCost(n, np.arange(n, dtype=np.int32), worth)
        highs.changeObjectiveSense(highspy.ObjSense.kMaximize)
        for rows in program.rows:
            self.add_rows(rows)
        highs.cbLogging += self._keep_message
        highs.cbSimplexInterrupt += self._interrupt_if_spent
        highs.cbIpmInterrupt += self._interrupt_if_spent

    def add_rows(self, rows: Rows) -> None:
        """Add constraints; the next run starts from the last one's basis."""
        status = self._highs.addRows(
            len(rows), rows.lower, rows.upper, len(rows.column), rows.first, rows.column, rows.value
        )
        # HiGHS adds none of them if a row names a column twice.
        assert status != highspy.HighsStatus.kError

    def hold(self, columns: Ints, values: Floats) -> None:
        """Fix some columns at these values."""
        self._highs.changeColsBounds(len(columns), columns, values, values)

    def relaxed(self) -> Floats | None:
        """Return the best fractional point, or None if the budget did not suffice.

        Large programs start with the interior point method, and continue from the corner next to
        its result: with turns to the sun this takes 0.6 and 0.8 s, the simplex method alone 7.3 and
        3.1 s (6,000 columns). With 3,000 columns it takes half as long, or twice.
        """
        is_large = self._num_columns > LARGE_PROGRAM and not self._highs.getBasis().valid
        self._highs.setOptionValue("solver", "ipm" if is_large else "choose")
        if not self._run():
            return None
        # With a named solver HiGHS would ignore that columns are integer.
        self._highs.setOptionValue("solver", "choose")
        if self._highs.getModelStatus() != highspy.HighsModelStatus.kOptimal:
            return None
        info = self._highs.getInfo()
        # The duals prove the value up to the infeasibility HiGHS tolerates, on columns up to one.
        doubt = float(info.sum_dual_infeasibilities) + SAME + self._left_out
        self._bound = min(self._bound, float(info.objective_function_value) + doubt)
        solution = self._highs.getSolution()
        self.columns, self.gains = np.array(solution.col_value), np.array(solution.col_dual)
        self.row_multipliers = np.array(solution.row_dual)
        return self.columns

    @property
    def bound(self) -> float:
        """What no point exceeds, as the relaxations so far have shown."""
        return self._bound

    @property
    def row_duals(self) -> Floats:
        """What the last relaxation would gain per unit of each row's limit."""
        multipliers: Floats = np.abs(np.array(self._highs.getSolution().row_dual))
        return multipliers

    @property
    def log(self) -> str:
        """The end of HiGHS's log, which holds the result."""
        return "".join(self._messages)[-LOG_CHARACTERS:]

    def search(
        self,
        start: Floats | None,
        gap: float,
        heuristic_effort: float | None,
        watch: Watch,
        max_nodes: int | None = None,
        unit: float = 0.0,
    ) -> Outcome:
        """Return the best integer point.

        Parameters
        ----------
        start
            Values of the first columns of a known point, all integer columns among them; or a
            fractional point, near which HiGHS looks first; or None.
        gap
            Relative distance of objective and bound at which to stop.
        heuristic_effort
            Share of the work spent on looking for points rather than on the proof; None for
            HiGHS's default.
        max_nodes
            Limit on branch-and-bound nodes; unlike a limit in seconds, the same everywhere.
        unit
            Amount of which every point's worth is a multiple, approximately; 0 if there is none.
        """
        if self._is_abandoned:
            # HiGHS is still in its last relaxation, and must not be touched.
            return self._so_far()
        highs = self._highs
        integer = np.flatnonzero(self._is_integer).astype(np.int32)
        kinds = np.full(len(integer), int(highspy.HighsVarType.kInteger), dtype=np.uint8)
        highs.changeColsIntegrality(len(integer), integer, kinds)
        highs.setOptionValue("mip_rel_gap", gap)
        if unit > 0.0:
            highs.setOptionValue("mip_abs_gap", NEARLY * unit)
        if heuristic_effort is not None:
            highs.setOptionValue("mip_heuristic_effort", heuristic_effort)
        if max_nodes is not None:
            highs.setOptionValue("mip_max_nodes", max_nodes)
        # From a fractional start HiGHS first solves a sub-program with its whole values fixed, and
        # reports that one's bounds too, which do not hold for the program itself.
        is_whole = start is not None and bool(np.all(start[integer] == np.round(start[integer])))
        if start is not None:
            highs.setSolution(len(start), np.arange(len(start), dtype=np.int32), start)

        def on_interrupt(event: highspy.highs.HighsCallbackEvent) -> None:
            out = event.data_out
            if not self._is_abandoned:
                if is_whole:
                    self._bound = min(self._bound, float(out.mip_dual_bound) + self._left_out)
                watch(float(out.mip_primal_bound), self._bound)
            self._interrupt_if_spent(event)

        def on_improved(event: highspy.highs.HighsCallbackEvent) -> None:
            self._incumbent = np.array(event.data_out.mip_solution)

        highs.cbMipInterrupt += on_interrupt
        highs.cbMipImprovingSolution += on_improved
        if not self._run():
            return self._so_far()
        info, status = highs.getInfo(), highs.getModelStatus()
        has_point = info.primal_solution_status == highspy.SolutionStatus.kSolutionStatusFeasible
        return Outcome(
            columns=np.array(highs.getSolution().col_value) if has_point else None,
            bound=min(self._bound, float(info.mip_dual_bound) + self._left_out),
            is_infeasible=status == highspy.HighsModelStatus.kInfeasible,
            log=self.log,
        )

    def _so_far(self) -> Outcome:
        columns, bound = self._incumbent, self._bound
        return Outcome(columns=columns, bound=bound, is_infeasible=False, log=self.log)

    def _run(self) -> bool:
        """Run HiGHS; return whether it ended in time, so that its results may be read."""
        remaining_s = self._budget.remaining_s()
        if remaining_s is not None:
            # HiGHS's clock adds up all its runs.
            self._highs.setOptionValue("time_limit", self._highs.getRunTime() + remaining_s)
        # Not a daemon: the interpreter must not end under a thread that will call into it.
        thread = threading.Thread(target=self._highs.run, name="highs")
        thread.start()
        while thread.is_alive() and not self._budget.is_spent():
            thread.join(POLL_S)
        thread.join(PAUSE_S)
        self._is_abandoned = thread.is_alive()
        return not self._is_abandoned

    def _keep_message(self, event: highspy.highs.HighsCallbackEvent) -> None:
        self._messages.append(event.message)

    def _interrupt_if_spent(self, event: highspy.highs.HighsCallbackEvent) -> None:
        if self._is_abandoned or self._budget.is_spent():
            event.interrupt()


def _noticeable(program: Program) -> tuple[Floats, float]:
    """Return the worths with tiny ones set to 0, and the most that those could have added.

    HiGHS 1.15 fails on worths that are 1e-17 of others: with images that earn so little on board
    it reported 0.768 as the optimum though a plan earns 0.917.
    """
    worth, lower, upper = map(np.concatenate, (program.worth, program.lower, program.upper))
    is_tiny = (worth != 0.0) & (np.abs(worth) < NOTHING * np.abs(worth).max(initial=0.0))
    most = np.maximum(worth[is_tiny] * lower[is_tiny], worth[is_tiny] * upper[is_tiny])
    return np.where(is_tiny, 0.0, worth), float(most.sum())
