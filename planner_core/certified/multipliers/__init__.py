"""Lagrangian multipliers: ascents that bring the bound down."""
