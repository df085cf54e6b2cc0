"""The planning core: pure functions and frozen values, no web, no database."""

__version__ = "0.2.0.dev0"
