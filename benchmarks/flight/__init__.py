"""Fly a timeline in Basilisk, a simulator that shares nothing with the planner.

Geometry, sun, eclipses and dynamics deliberately do not come from ``planner_core``: nothing in this
package imports it, so a mistake there cannot go unnoticed here.
"""
