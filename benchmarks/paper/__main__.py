"""The paper's study with one command: ``python -m benchmarks.paper [--quick]``."""

from __future__ import annotations

import argparse
import os
import sys
import time
from pathlib import Path
from typing import Final

from benchmarks.paper.pool import Pool
from benchmarks.paper.progress import ProgressBar
from benchmarks.paper.report import write_report
from benchmarks.paper.store import Store, code_id
from benchmarks.paper.study import Study, quick

HOURS: Final = 1.9
QUICK_HOURS: Final = 4.5 / 60.0
_REPORT_S: Final = 20.0


def main() -> None:
    """Read the options, run what is missing, write the page."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.paper", description=__doc__)
    parser.add_argument("--quick", action="store_true", help="one draw and thinned grids")
    parser.add_argument("--hours", type=float, help="time for the whole study")
    parser.add_argument("--workers", type=int, default=os.cpu_count() or 1)
    parser.add_argument("--docs", type=Path, help="where the page and its plots are written")
    parser.add_argument("--work", type=Path, help="where finished runs are kept")
    options = parser.parse_args()
    name = "paper-quick" if options.quick else "paper"
    work: Path = options.work or Path("build") / name
    docs: Path = options.docs or (work if options.quick else Path("docs"))
    hours = options.hours or (QUICK_HOURS if options.quick else HOURS)
    study = quick() if options.quick else Study()
    command = "make paper-quick" if options.quick else "make paper"
    began = time.time()
    store = Store(work / f"runs-{code_id()}.csv")
    run(study, store, began + hours * 3600.0 - _REPORT_S, options.workers)
    took_min = (time.time() - began) / 60.0
    in_all_min = store.minutes_in_all(took_min)
    page = write_report(study, store.done, docs, took_min=in_all_min, command=command)
    print(f"Wrote {page} after {took_min:.1f} minutes; finished runs are kept in {work}.")


def run(study: Study, store: Store, deadline: float, workers: int) -> None:
    """Run what is missing, phase by phase, until the deadline."""
    everything = study.all_tasks()
    bar = ProgressBar(sys.stderr, len(everything), deadline)
    with Pool(workers, deadline) as pool:
        for phase, choose in study.phases():
            done = len(everything) - len(store.missing(everything))
            bar.show(done, phase, always=True)
            for task, outcome in pool.run(store.missing(choose(store.done))):
                store.add(task, outcome)
                done += 1
                bar.show(done, phase)
    bar.close()


if __name__ == "__main__":
    main()
