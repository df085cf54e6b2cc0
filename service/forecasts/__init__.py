"""Forecasts of clear skies: files read, kept, and asked for the targets of a question."""
