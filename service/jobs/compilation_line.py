"""The output line that shows the progress of compilation."""

from __future__ import annotations

import inspect
import sys
import time
from functools import partial
from typing import Final, TextIO

from planner_core.jit import compiled_kernels, stored_signatures

_EVERY_S: Final = 10.0  # if lines cannot be overwritten
_TOO_FEW: Final = 0.1  # below this share of the kernels, the time left cannot be estimated yet


class CompilationLine:
    """Measures progress in source lines of kernels, roughly proportional to compile time.

    Nothing is printed before the first kernel is compiled: if all are on disk, there is no need.

    Parameters
    ----------
    share
        Share of the source lines of all kernels to be compiled now or already on disk.
    """

    def __init__(self, began_s: float, share: float = 1.0, out: TextIO = sys.stdout) -> None:
        self._began_s, self._shown_s, self._is_terminal = began_s, 0.0, out.isatty()
        self._print = partial(print, file=out, flush=True)
        num_lines = {
            kernel.py_func.__qualname__: len(inspect.getsourcelines(kernel.py_func)[0])
            for kernel in compiled_kernels()
        }
        stored_names = {name.rpartition(".")[2] for name, on in stored_signatures().items() if on}
        self._left = {name: num for name, num in num_lines.items() if name not in stored_names}
        stored = sum(num_lines.values()) - sum(self._left.values())
        self._total = max(1.0, share * sum(num_lines.values()) - stored)
        self._done = 0
        self._is_open = False

    def compiled(self, name: str) -> None:
        """Count a kernel."""
        if not self._is_open:
            self._is_open = True
            self._print("Compiling the planning kernels (once) ...")
        self._done += self._left.pop(name, 0)

    def show(self) -> None:
        """Print the progress: continually in a terminal, now and then elsewhere."""
        now_s = time.monotonic()
        every_s = 0.5 if self._is_terminal else _EVERY_S
        if self._done < _TOO_FEW * self._total or now_s - self._shown_s < every_s:
            return
        self._shown_s = now_s
        share = min(self._done / self._total, 0.99)
        left_s = (now_s - self._began_s) * (1.0 - share) / share
        text = f"  {share:3.0%}, about {left_s:.0f} s left"
        if self._is_terminal:
            self._print(f"\r{text:<40}", end="")
        else:
            self._print(text)

    def end(self) -> None:
        """Print how long it took."""
        if self._done:
            begin = "\r" if self._is_terminal else ""
            took_s = time.monotonic() - self._began_s
            self._print(f"{begin}Kernels are ready ({took_s:.1f} s).".ljust(40))
