"""What can be wrong with data given to the planner.

``ValueError`` is kept for mistakes in calling code. Everything here is about
*data*: it carries what a machine needs (code, position) and a sentence for people.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass, replace


@dataclass(frozen=True, slots=True)
class Fault:
    """One thing that is wrong, and where.

    Attributes
    ----------
    code
        Stable machine-readable name, for example ``tle_checksum``.
    detail
        One sentence that names the value and the limit.
    pointer
        JSON pointer into the input, if that was JSON.
    row
        Line of the file, from 1, if the input was a file.
    """

    code: str
    detail: str
    pointer: str | None = None
    row: int | None = None


class PlannerError(Exception):
    """Data that the planner cannot accept; the base of every error below."""

    def __init__(
        self, code: str, detail: str, *, pointer: str | None = None, row: int | None = None
    ):
        super().__init__(detail)
        self.fault = Fault(code=code, detail=detail, pointer=pointer, row=row)

    @property
    def code(self) -> str:
        """The machine-readable name of the fault."""
        return self.fault.code

    @property
    def detail(self) -> str:
        """The sentence for people."""
        return self.fault.detail


class InvalidElements(PlannerError):
    """Orbital elements that cannot be read, or whose theory is not supported."""


class InvalidScenario(PlannerError):
    """A scenario that makes no sense as a whole."""


class InvalidParameters(PlannerError):
    """Solver parameters that the solver does not have or cannot take."""


class UnknownSolver(PlannerError):
    """No solver of that name."""


class PropagationFailed(PlannerError):
    """SGP4 stopped before the end of the horizon.

    Attributes
    ----------
    satellite
        Name of the satellite.
    sgp4_code
        The error code of SGP4 (1 to 6).
    """

    def __init__(self, satellite: str, sgp4_code: int, detail: str):
        super().__init__("propagation_failed", detail)
        self.satellite = satellite
        self.sgp4_code = sgp4_code


@contextmanager
def pointing(place: Callable[[Fault], str | None]) -> Iterator[None]:
    """Set the pointer of errors raised within to what ``place`` returns for their fault."""
    try:
        yield
    except PlannerError as error:
        error.fault = replace(error.fault, pointer=place(error.fault))
        raise


def inside(pointer: str) -> AbstractContextManager[None]:
    """Prefix the pointers of errors raised within with ``pointer``."""
    return pointing(lambda fault: pointer + (fault.pointer or ""))


class Cancelled(Exception):
    """Work without a partial result was told to stop (access search, compiling)."""
