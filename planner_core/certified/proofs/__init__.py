"""Proven upper bounds on what any plan can earn, and the proofs to check them by."""
