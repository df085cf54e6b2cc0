"""Queue work: dispatch, leases, the solver process."""
