"""The paper's five solvers, one module each, and what they share."""
