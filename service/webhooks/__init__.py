"""Webhooks: what ends is told to those who asked, signed, until they have it."""
