"""Missions drawn at random over all options, planned in every way that there is."""
