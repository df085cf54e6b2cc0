"""Pins, what a plan must and must not hold: found by their names and compiled into a problem."""
