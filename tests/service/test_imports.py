"""Garbage collection never scans imported modules."""

from __future__ import annotations

import gc

from service.process.imports import importing


def test_garbage_is_looked_for_again_afterwards_but_not_in_what_was_imported() -> None:
    assert gc.isenabled()
    with importing():
        with importing():
            stays: list[object] = []
        assert not gc.isenabled(), "what is imported within may do the same"
    assert gc.isenabled()
    assert not any(each is stays for each in gc.get_objects())
