"""The planning core: pure functions and frozen values, without web or database."""

__version__ = "0.2.0.dev0"
