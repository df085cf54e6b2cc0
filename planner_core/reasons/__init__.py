"""Why a target is not in a plan, how certain that is, and what would let it in."""
