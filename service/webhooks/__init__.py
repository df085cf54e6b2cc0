"""Webhooks: signed messages about ended jobs and changed plans, resent until they arrive."""
