"""How many examples the property tests try.

``full`` tries all that a test asks for, ``quick`` a fifth of them, and both the same ones in each
run, so that a change is not refused for what it has not touched. ``explore`` draws as many as
``full``, anew in each run, and ``thorough`` ten times as many. ``SLEWLINE_TEST_PROFILE`` chooses.
"""

from __future__ import annotations

import math
import os
from typing import Final

from hypothesis import HealthCheck, settings

_ALL: Final = 100

# How long an example takes says more of the machine than of the code.
settings.register_profile(
    "explore", max_examples=_ALL, deadline=None, suppress_health_check=[HealthCheck.too_slow]
)
settings.register_profile("thorough", settings.get_profile("explore"), max_examples=1000)
settings.register_profile("full", settings.get_profile("explore"), derandomize=True)
settings.register_profile("quick", settings.get_profile("full"), max_examples=20)


def load_profile() -> None:
    """Take the profile that the environment names; ``quick`` without a name."""
    settings.load_profile(os.environ.get("SLEWLINE_TEST_PROFILE", "quick"))


def is_full() -> bool:
    """Return whether all is tried that tests ask for, not a fifth of it."""
    return settings().max_examples >= _ALL


def examples(number: int) -> settings:
    """Return the settings of a test that tries so many examples in a full run."""
    return settings(max_examples=math.ceil(number * settings().max_examples / _ALL))
