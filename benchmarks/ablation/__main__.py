"""Run the missing parts of the ablation, and write its page.

``python -m benchmarks.ablation`` tries all strategies, ``--constants`` also half and double of the
constants (hours), ``--only`` changes whose name contains one of these words, ``--anew`` also those
known from another revision. Rows go into docs/ablation.csv, their page into docs/ablation.md.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Final

from benchmarks.ablation.constants import constants
from benchmarks.ablation.page import page
from benchmarks.ablation.strategies import STRATEGIES
from benchmarks.ablation.trials import Trial, run
from benchmarks.suite import rows

_ROWS: Final = Path("docs/ablation.csv")


def main() -> None:
    """Run the command line."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.ablation", description=__doc__)
    parser.add_argument("--into", type=Path, default=_ROWS, metavar="FILE")
    parser.add_argument("--constants", action="store_true", help="half and double of each as well")
    parser.add_argument("--only", nargs="+", default=[""], metavar="WORD")
    parser.add_argument("--anew", action="store_true", help="also what other revisions have run")
    options = parser.parse_args()
    changes = {**STRATEGIES, **(constants() if options.constants else {})}
    chosen = [name for name in changes if any(word in name for word in options.only)]
    run({name: changes[name] for name in chosen}, options.into, anew=options.anew)
    text = page(rows.read(options.into, Trial))
    options.into.with_suffix(".md").write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
