"""The planning problem as a mixed-integer linear program, and HiGHS to solve it."""
