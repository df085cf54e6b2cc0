"""Files of any size that are made to break parsers: deep, wide, endless."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Final

from tests.planner_core.orbits.element_sets import LINE_1, LINE_2, omm

TEXT: Final = "text/plain"
CSV: Final = "text/csv"
JSON: Final = "application/json"
GEO: Final = "application/geo+json"
XML: Final = "application/xml"
ALL: Final = (TEXT, CSV, JSON, GEO, XML)

_HEADER: Final = "id,name,lat_deg,lon_deg\n"
_FEATURES: Final = '{"type":"FeatureCollection","features":['
_TARGETS: Final = '{"name":"n","targets":['


@dataclass(frozen=True, slots=True)
class Nasty:
    """A file and the media types it may claim; ``make`` takes its size in bytes."""

    name: str
    kinds: tuple[str, ...]
    make: Callable[[int], bytes]


def repeated(name: str, kinds: tuple[str, ...], unit: str, start: str = "", end: str = "") -> Nasty:
    """Return a file that repeats the same unit."""
    return Nasty(
        name, kinds, lambda size: (start + unit * (size // len(unit.encode())) + end).encode()
    )


def counted(name: str, kinds: tuple[str, ...], start: str, unit: str, end: str) -> Nasty:
    """Return a file in which ``#`` counts up."""

    def make(size: int) -> bytes:
        units = (unit.replace("#", str(number)) for number in range(size // (len(unit) + 5)))
        return (start + "".join(units) + end).encode()

    return Nasty(name, kinds, make)


def nested(name: str, kinds: tuple[str, ...], opening: str, closing: str) -> Nasty:
    """Return a file as deep as it is long."""

    def make(size: int) -> bytes:
        depth = size // len(opening + closing)
        return (opening * depth + closing * depth).encode()

    return Nasty(name, kinds, make)


def _lines() -> Iterator[Nasty]:
    yield repeated("one endless line", ALL, "1 25544U ")
    yield repeated("one endless line of NULs", ALL, "\0")
    yield repeated("nothing but line ends", ALL, "\n")
    yield repeated("lines of one letter", (TEXT, CSV), "a\n")
    yield repeated("lines of two letters and a CR", (TEXT, CSV), "ab\r")
    yield repeated("first lines without a second", (TEXT,), f"{LINE_1}\n")
    yield repeated("the same set again and again", (TEXT,), f"{LINE_1}\n{LINE_2}\n")
    yield repeated("one message of many lines", (TEXT,), "A=\n", "CCSDS_OMM_VERS = 2.0\n")
    yield repeated("messages of one line", (TEXT,), "CCSDS_OMM_VERS=2.0\n")


def _json() -> Iterator[Nasty]:
    both = (JSON, GEO)
    yield repeated("opened lists", both, "[")
    yield repeated("opened objects", both, '{"a":')
    yield nested("nested lists", both, "[", "]")
    yield repeated("a list of ones", both, "1,", "[", "1]")
    yield repeated("a list of empty lists", both, "[],", "[", "[]]")
    yield repeated("a list of empty objects", both, "{},", "[", "{}]")
    yield repeated("a list of halves of pairs", both, r'"\ud800",', "[", "1]")
    yield repeated("empty features", (GEO,), "{},", _FEATURES, "{}]}")
    yield repeated("features that are ones", (GEO,), "1,", _FEATURES, "1]}")
    yield repeated("empty targets", (JSON,), "{},", _TARGETS, "{}]}")
    yield repeated("targets that are ones", (JSON,), "1,", _TARGETS, "1]}")
    yield counted("an object of many keys", both, "{", '"#":0,', '"":0}')
    yield counted("a target of many keys", (JSON,), _TARGETS + "{", '"#":0,', '"":0}]}')
    yield counted("an element set of many keys", (JSON,), "[{", '"#":0,', '"":0}]')
    yield repeated("the same key again and again", both, '"a":1,', "{", '"a":1}')
    yield repeated("a string without an end", both, "a", '"')
    yield repeated("a number of many digits", both, "9", "[", "]")
    yield repeated("a fraction of many digits", both, "9", "[0.", "]")
    yield repeated("an exponent of many digits", both, "9", "[1e", "]")


def _csv() -> Iterator[Nasty]:
    elements = ",".join(omm())
    yield repeated("columns without end", (CSV,), "a,")
    yield counted("different columns", (CSV,), "", "#,", "z\n")
    yield repeated("columns without a name", (CSV,), ",", _HEADER)
    yield repeated("rows of one cell", (CSV,), "1\n", _HEADER)
    yield repeated("rows out of range", (CSV,), "1,2,91,0\n", _HEADER)
    yield repeated("rows that are fine", (CSV,), "1,2,1,0\n", _HEADER)
    yield repeated("rows of nothing", (CSV,), "," * elements.count(",") + "\n", f"{elements}\n")
    yield repeated("a quote without an end", (CSV,), "x\n", f'{_HEADER}"')
    yield repeated("quotes", (CSV,), '"', _HEADER)


def _xml() -> Iterator[Nasty]:
    yield repeated("opened elements", (XML,), "<a>")
    yield nested("nested elements", (XML,), "<a>", "</a>")
    yield repeated("empty messages", (XML,), "<omm/>", "<ndm>", "</ndm>")
    yield repeated("one message of many leaves", (XML,), "<A/>", "<omm>", "</omm>")
    yield counted("many attributes", (XML,), "<omm ", "a#='' ", "/>")
    yield counted("many names", (XML,), "<omm>", "<a#/>", "</omm>")
    yield repeated("a comment without an end", (XML,), "-", "<!--")
    yield Nasty("billion laughs", (XML,), _laughs)


def _laughs(_size: int) -> bytes:
    entities = "".join(f'<!ENTITY l{n} "{f"&l{n - 1};" * 10}">' for n in range(1, 10))
    return f'<!DOCTYPE omm [<!ENTITY l0 "ha">{entities}]><omm>&l9;</omm>'.encode()


NASTIES: Final = (*_lines(), *_json(), *_csv(), *_xml())
