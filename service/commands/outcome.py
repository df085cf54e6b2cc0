"""How a command ends: its exit status, and the errors behind a status other than 0."""

from __future__ import annotations

from typing import Final

OK: Final = 0
FAILED: Final = 1
WRONG_INPUT: Final = 2


class WrongInput(Exception):
    """An error on the command line, in the environment or in a file; the message names it."""


class Failed(Exception):
    """The command cannot do its work; the message says why."""
