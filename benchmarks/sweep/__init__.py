"""Missions drawn at random over all options, planned in every available way."""
