"""Orbit Ephemeris Messages in XML."""

from __future__ import annotations

from xml.etree.ElementTree import Element

from planner_core.errors import InvalidElements
from planner_core.orbits.oem import OemSegment
from planner_core.orbits.omm_files import tag_of

_STATE = ("X", "Y", "Z", "X_DOT", "Y_DOT", "Z_DOT")
_UNITS = {**dict.fromkeys(_STATE[:3], "km"), **dict.fromkeys(_STATE[3:], "km/s")}


def xml_segments(message: Element) -> list[OemSegment]:
    """Return the segments of an ``oem`` element.

    Raises
    ------
    InvalidElements
        ``oem_syntax`` or ``oem_missing_key``.
    """
    segments = []
    for element in message.iter():
        if tag_of(element) != "segment":
            continue
        segment = OemSegment()
        for part in element:
            if tag_of(part) == "metadata":
                segment.meta.update({tag_of(leaf): (leaf.text or "").strip() for leaf in part})
            elif tag_of(part) == "data":
                vectors = [one for one in part if tag_of(one) == "stateVector"]
                segment.states.extend(_state(one, at) for at, one in enumerate(vectors))
        segments.append(segment)
    return segments


def _state(element: Element, at: int) -> tuple[str, tuple[str, ...], None]:
    leaves = {tag_of(leaf): leaf for leaf in element}
    texts = []
    for key in ("EPOCH", *_STATE):
        if key not in leaves:
            raise InvalidElements("oem_missing_key", f"stateVector {at + 1} lacks {key}")
        unit = leaves[key].get("units")
        if unit is not None and unit.strip().lower() != _UNITS.get(key):
            detail = (
                f"{key} of stateVector {at + 1} is in {unit[:40]!a}, must be in {_UNITS.get(key)}"
            )
            raise InvalidElements("omm_unit", detail)
        texts.append((leaves[key].text or "").strip())
    return texts[0], tuple(texts[1:]), None
