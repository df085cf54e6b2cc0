"""Precedence among a satellite's tasks, and longest paths over it."""
