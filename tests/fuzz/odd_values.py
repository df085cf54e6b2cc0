"""Small files with misleading values: not finite, not text, given twice."""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Any, Final

from tests.fuzz.nasty import ALL, CSV, GEO, JSON, TEXT, XML
from tests.planner_core.orbits.element_sets import LINE_1, LINE_2, omm

Odd = tuple[str, tuple[str, ...], bytes]
"""A description, the media types it may claim, and the file."""

NUMBERS: Final = ("NaN", "Infinity", "-Infinity", "1e308", "1e400", "-1e400", "0x10", "1_000", "٣")
LONG_NUMBERS: Final = ("9" * 5000, "1" + "0" * 400, "0." + "9" * 5000, "1e" + "9" * 5000)


def _encoded(text: str) -> bytes:
    return text.encode("utf-8", "surrogatepass")


def _target(**fields: Any) -> str:
    return json.dumps(
        {"name": "n", "targets": [{"id": "a", "lat_deg": 1.5, "lon_deg": 2.0} | fields]}
    )


def _collection(*features: Any) -> str:
    return json.dumps({"type": "FeatureCollection", "features": features})


def _feature(**fields: Any) -> dict[str, Any]:
    geometry = {"type": "Point", "coordinates": [2.0, 1.5]}
    return {
        "type": "Feature",
        "geometry": geometry,
        "properties": {"id": "a", "name": "a"},
    } | fields


def _numbers() -> Iterator[Odd]:
    for literal in NUMBERS + LONG_NUMBERS:
        name = literal[:12]
        yield f"latitude {name}", (JSON,), _encoded(_target().replace("1.5", literal))
        yield f"latitude {name}", (GEO,), _encoded(_collection(_feature()).replace("1.5", literal))
        yield f"latitude {name}", (CSV,), _encoded(f"id,name,lat_deg,lon_deg\na,b,{literal},8\n")
        message = json.dumps([omm(MEAN_MOTION=1.5)]).replace("1.5", literal)
        yield f"mean motion {name}", (JSON,), _encoded(message)


def _texts() -> Iterator[Odd]:
    for name, text in (("a NUL", "a\0b"), ("half a pair", "\ud800"), ("a line end", "a\u2028b")):
        yield f"{name} in an id", (JSON,), _encoded(_target(id=text))
        yield f"{name} in the name of a field", (JSON,), _encoded(_target(**{text: 1}))
        yield f"{name} in an id", (GEO,), _encoded(_collection(_feature(id=text)))
        yield f"{name} in a property", (GEO,), _encoded(_collection(_feature(properties={text: 1})))
        yield f"{name} in a name", (JSON,), _encoded(json.dumps([omm(OBJECT_NAME=text)]))
        yield f"{name} in a keyword", (JSON,), _encoded(json.dumps([omm() | {text: 1}]))
        yield f"{name} in a cell", (CSV,), _encoded(f"id,name,lat_deg,lon_deg\n{text},{text},1,2\n")
        yield (
            f"{name} in a header",
            (CSV,),
            _encoded(f"id,name,lat_deg,lon_deg,{text}\na,b,1,2,3\n"),
        )
        yield f"{name} in a name line", (TEXT,), _encoded(f"{text}\n{LINE_1}\n{LINE_2}\n")


def _encodings() -> Iterator[Odd]:
    yield "UTF-16", ALL, "id,lat_deg,lon_deg\na,1,2\n".encode("utf-16")
    yield "UTF-32", ALL, '{"a": 1}'.encode("utf-32")
    yield "half a character", ALL, b"\xf0\x9f\x9b"
    yield "XML in UTF-16", (XML,), '<?xml version="1.0" encoding="utf-16"?><omm/>'.encode("utf-16")
    yield "XML of another encoding", (XML,), b'<?xml version="1.0" encoding="zlib"?><omm/>'
    yield "compressed", ALL, bytes.fromhex("1f8b080000000000000303000000000000000000")


def _shapes() -> Iterator[Odd]:
    twice = '{"name": "a", "name": "b", "targets": [{"id": "a", "id": "b", "lat_deg": 1}]}'
    yield "the same field twice", (JSON,), _encoded(twice)
    none: tuple[Any, ...] = (
        None,
        1,
        [],
        {},
        {"type": "Feature"},
        _feature(geometry=None),
        _feature(id={}),
    )
    yield "features that are none", (GEO,), _encoded(_collection(*none, _feature(properties=[1])))
    for position in (None, [], [1], [1, 2, 3, 4], ["a", "b"], [[1], [2]], [True, 0], [10**400, 0]):
        geometry = {"type": "Point", "coordinates": position}
        yield "a position", (GEO,), _encoded(_collection(_feature(geometry=geometry)))


def _line_ends() -> Iterator[Odd]:
    mixed = f"\ufeffA\r{LINE_1}\r\n{LINE_2}\n\rB\n\n{LINE_1}\r{LINE_2}"
    yield "every line end", (TEXT,), _encoded(mixed)
    foreign = f"A\u2028{LINE_1}\x85{LINE_2}\x0b{LINE_1}\x0c{LINE_2}"
    yield "line ends of Unicode", (TEXT,), _encoded(foreign)


def _outside() -> Iterator[Odd]:
    file = "file:///etc/passwd"
    yield "a document type", (XML,), f'<!DOCTYPE omm SYSTEM "{file}"><omm/>'.encode()
    entity = f'<!DOCTYPE omm [<!ENTITY x SYSTEM "{file}">]><omm><EPOCH>&x;</EPOCH></omm>'
    yield "an entity from a file", (XML,), entity.encode()


ODD_FILES: Final = (
    *_numbers(),
    *_texts(),
    *_encodings(),
    *_shapes(),
    *_line_ends(),
    *_outside(),
)
