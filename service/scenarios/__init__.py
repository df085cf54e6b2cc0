"""Scenarios as files and requests have them: read, checked, changed and translated for the core."""
