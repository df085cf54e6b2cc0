"""Load the solvers and run their kernels once, so that no job pays for it.

``python -m service.jobs.warm`` fills the cache of compiled kernels on disk.
"""

from __future__ import annotations

import time

from service.jobs.plan_job import warm_up


def main() -> None:
    """Compile what is not yet compiled, and say how long it took."""
    began_s = time.monotonic()
    warm_up()
    print(f"Kernels are ready ({time.monotonic() - began_s:.1f} s).")


if __name__ == "__main__":
    main()
