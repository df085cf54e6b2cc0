"""Replanning: what is flown stays as it was, and the rest changes as little as possible."""
