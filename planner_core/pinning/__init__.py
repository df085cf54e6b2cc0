"""Pins: what a plan must hold and must not, in words and compiled into a problem."""
