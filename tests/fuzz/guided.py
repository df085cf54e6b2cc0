"""Coverage-guided fuzzing of all parsers: ``python -m tests.fuzz.guided [RUNS] [PARSER]``.

`Atheris <https://github.com/google/atheris>`_ watches which branches each input takes and keeps
mutating those that took new ones. It has wheels for Linux only, so it is no dependency:
``make fuzz`` installs it. The number of runs is fixed, not the time, and so is the seed.
"""

from __future__ import annotations

import importlib
import os
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Final

RUNS: Final = 10_000
_SEED: Final = 1
_LONGEST_INPUT: Final = 4096
_WATCHED: Final = (
    "planner_core.orbits.element_ranges",
    "planner_core.orbits.ingest",
    "planner_core.orbits.omm",
    "planner_core.orbits.omm_files",
    "planner_core.orbits.tle",
    "planner_core.orbits.tle_file",
    "service.files.records",
    "service.scenarios.translate",
)


def main(words: list[str]) -> int:
    """Fuzz one parser, or each in a process of its own; return the exit status."""
    runs = int(words[0]) if words else RUNS
    if len(words) > 1:
        fuzz(words[1], runs)
    from tests.fuzz.parsers import PARSERS

    for parser in PARSERS:
        command = [sys.executable, "-m", __spec__.name, str(runs), parser]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        print(f"{parser}: {runs} runs, {'nothing found' if not done.returncode else 'FAILED'}")
        if done.returncode:
            print(done.stdout[-5000:], done.stderr[-5000:], sep="\n")
            return 1
    return 0


def fuzz(parser: str, runs: int) -> None:
    """Fuzz one parser; ends the process."""
    import atheris

    with atheris.instrument_imports(include=list(_WATCHED)):
        for module in _WATCHED:
            importlib.import_module(module)
    from tests.fuzz.corpus import seeds, shared_seeds
    from tests.fuzz.parsers import PARSERS

    folder = Path(tempfile.mkdtemp(prefix="slewline-fuzz-"))
    files = seeds(parser)
    shared = os.environ.get("SLEWLINE_TEST_DATA")
    if shared is not None:
        files += shared_seeds(parser, Path(shared))
    for number, data in enumerate(files):
        (folder / f"seed-{number}").write_bytes(data)
    parse = PARSERS[parser]
    options = [f"-runs={runs}", f"-seed={_SEED}", f"-max_len={_LONGEST_INPUT}"]
    options += ["-timeout=20", "-rss_limit_mb=2000", f"-artifact_prefix={folder}/"]
    atheris.Setup([sys.argv[0], *options, str(folder)], lambda data: parse(data) and None)
    atheris.Fuzz()


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
