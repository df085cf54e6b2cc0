"""Fly a timeline in Basilisk, a simulator that shares nothing with the planner.

Geometry, sun, eclipses and dynamics are of other origin here than in ``planner_core``, on purpose:
nothing in this package imports it, so a mistake there cannot hide itself here.
"""
