"""Attacks on the running service, each of which once did harm."""
