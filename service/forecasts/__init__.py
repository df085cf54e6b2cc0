"""Forecasts of clear skies: read from files, stored, and evaluated for a scenario's targets."""
