"""How many examples the property tests try.

``full`` tries all that a test requests and ``quick`` a fifth of them, both the same ones in each
run, so that a change is not refused for code it has not touched. ``explore`` draws as many as
``full``, new ones in each run, and ``thorough`` ten times as many. ``SLEWLINE_TEST_PROFILE``
selects.
"""

from __future__ import annotations

import math
import os
from typing import Final

from hypothesis import HealthCheck, settings

_ALL: Final = 100

# The time an example takes says more about the machine than about the code.
settings.register_profile(
    "explore", max_examples=_ALL, deadline=None, suppress_health_check=[HealthCheck.too_slow]
)
settings.register_profile("thorough", settings.get_profile("explore"), max_examples=1000)
settings.register_profile("full", settings.get_profile("explore"), derandomize=True)
settings.register_profile("quick", settings.get_profile("full"), max_examples=20)


def load_profile() -> None:
    """Load the profile that the environment names; ``quick`` by default."""
    settings.load_profile(os.environ.get("SLEWLINE_TEST_PROFILE", "quick"))


def is_full() -> bool:
    """Return whether tests try all examples they request, not a fifth of them."""
    return settings().max_examples >= _ALL


def examples(number: int) -> settings:
    """Return the settings of a test that tries this number of examples in a full run."""
    return settings(max_examples=math.ceil(number * settings().max_examples / _ALL))
