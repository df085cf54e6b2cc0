"""Scenarios in files and requests: read, checked, changed, and translated for the core."""
