"""One satellite's images by the slots of time in which they start, and its contacts."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from planner_core.certified.sizes import SLOT_S
from planner_core.certified.tolerances import ROUNDED_S
from planner_core.precedence.time_windows import time_windows_of
from planner_core.problem import COLLECT, CONTACT, Floats, Ints, Longs, Problem


class Windows(NamedTuple):
    """Spans in which the image of an access may start; shape ``(num_windows,)`` each.

    Attributes
    ----------
    row
        An opportunity of the access.
    open_s, close_s
        The first and the last start.
    length_s
        Of the image.
    """

    row: Ints
    open_s: Floats
    close_s: Floats
    length_s: Floats


class SlotImages(NamedTuple):
    """Images by the slot in which they start, window by window; shape ``(num_images,)`` each.

    Attributes
    ----------
    window, slot
        Of each.
    from_s, to_s
        The first and the last start in the slot.
    length_s
        Of each.
    member, first
        The opportunities that an image may be, image by image, and where those of each begin.
        Shapes ``(num_members,)`` and ``(num_images,)``.
    """

    window: Longs
    slot: Longs
    from_s: Floats
    to_s: Floats
    length_s: Floats
    member: Ints
    first: Longs

    def most(self, values: Floats) -> Floats:
        """Return the largest value of the opportunities that each image may be."""
        return _most(values[self.member], self.first)


class SlotTable(NamedTuple):
    """One satellite's tasks by slots.

    Attributes
    ----------
    edge_s
        Where slots begin and end. Shape ``(num_slots + 1,)``.
    contacts
        The satellite's contacts among its tasks. Shape ``(num_contacts,)``.
    part, during_s
        Contact and slot of each part of a contact, and its seconds there.
        Shapes ``(2, num_parts)`` and ``(num_parts,)``.
    """

    edge_s: Floats
    windows: Windows
    images: SlotImages
    contacts: Longs
    part: Longs
    during_s: Floats

    @property
    def num_slots(self) -> int:
        """How many slots there are."""
        return len(self.edge_s) - 1

    def slot_of(self, at_s: Floats) -> Longs:
        """Return the slot of each instant; its end belongs to a slot, its beginning does not."""
        return _slot_of(self.edge_s, at_s)


def slot_table(problem: Problem, index: int) -> SlotTable:
    """Return the table of one satellite."""
    satellite = problem.satellites[index]
    num_slots = max(1, math.ceil(problem.horizon_s / SLOT_S))
    edge_s = np.linspace(0.0, problem.horizon_s, num_slots + 1)
    images_of = _continuous if problem.continuous_starts else _of_opportunities
    windows, images = images_of(problem, index, edge_s)
    contacts = np.flatnonzero(satellite.kind == CONTACT)
    start_s, end_s = satellite.start_s[contacts, None], satellite.end_s[contacts, None]
    during_s = np.minimum(end_s, edge_s[1:]) - np.maximum(start_s, edge_s[:-1])
    part = np.array(np.nonzero(during_s > 0.0))
    return SlotTable(edge_s, windows, images, contacts, part, during_s[tuple(part)])


def _slot_of(edge_s: Floats, at_s: Floats) -> Longs:
    return np.clip(np.searchsorted(edge_s, at_s) - 1, 0, len(edge_s) - 2).astype(np.int64)


def _continuous(problem: Problem, index: int, edge_s: Floats) -> tuple[Windows, SlotImages]:
    """Return images that may start at any instant of their windows."""
    spans = time_windows_of(problem, index)
    open_s, close_s = spans.open_s - ROUNDED_S, spans.close_s + ROUNDED_S
    first, last = (_slot_of(edge_s, at_s) for at_s in (open_s, close_s))
    count = last - first + 1
    window = np.repeat(np.arange(len(count)), count)
    slot = np.arange(len(window)) - np.repeat(np.cumsum(count) - count - first, count)
    images = SlotImages(
        window=window,
        slot=slot,
        from_s=np.maximum(open_s[window], edge_s[slot]),
        to_s=np.minimum(close_s[window], edge_s[slot + 1]),
        length_s=spans.length_s[window],
        member=spans.row[window],
        first=np.arange(len(window)),
    )
    return Windows(spans.row, spans.open_s, spans.close_s, spans.length_s), images


def _of_opportunities(problem: Problem, index: int, edge_s: Floats) -> tuple[Windows, SlotImages]:
    """Return images that start where an opportunity does; those of an access and a slot are one."""
    satellite, access = problem.satellites[index], problem.opportunities.access
    own = np.flatnonzero(satellite.kind == COLLECT)
    slot = _slot_of(edge_s, satellite.start_s[own])
    order = np.lexsort((slot, access[satellite.rows[own]]))
    own, slot, row = own[order], slot[order], satellite.rows[own[order]]
    start_s = satellite.start_s[own]
    length_s = satellite.end_s[own] - start_s
    _, window = np.unique(access[row], return_index=True)
    _, first = np.unique(np.column_stack([access[row], slot]), axis=0, return_index=True)
    windows = Windows(
        row=row[window],
        open_s=-_most(-start_s, window),
        close_s=_most(start_s, window),
        length_s=-_most(-length_s, window),
    )
    images = SlotImages(
        window=np.searchsorted(window, first, side="right") - 1,
        slot=slot[first],
        from_s=-_most(-start_s, first),
        to_s=_most(start_s, first),
        length_s=-_most(-length_s, first),
        member=row,
        first=first,
    )
    return windows, images


def _most(values: Floats, first: Longs) -> Floats:
    """Return the largest value of each group, from where groups begin."""
    return np.maximum.reduceat(values, first) if len(first) else np.zeros(0)
