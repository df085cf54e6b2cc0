"""The planning core: pure functions and frozen values, no web, no database."""

__version__ = "0.1.0"
