"""Why a target is not in a plan, how certain the reason is, and what change would let it in."""
