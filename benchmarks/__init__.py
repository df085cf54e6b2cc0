"""Timings and plan quality; run by hand, never asserted in tests."""
