"""However a good file is damaged, the parsers say what is wrong with it."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.fuzz.corpus import seeds, shared_seeds
from tests.fuzz.parsers import PARSERS

REAL = (
    *(parser for parser in PARSERS if parser.startswith("elements")),
    *("targets text/csv", "stations application/geo+json"),
)
_PIECES = (
    *(b"\0", b"\n", b"\r", b"\t", b" ", b'"', b",", b"[", b"]", b"{", b"}", b"<", b">", b"&", b"="),
    *(b"-", b".", b"e", b"0", b"9", b"\xff", b"\xef\xbb\xbf", b"\xed\xa0\x80", "²".encode()),
    *(b"NaN", b"null", b"true", b"1e400", b"\\ud800", b"9" * 400, b"1 ", b"2 ", b"0 ", b"COMMENT"),
)


@st.composite
def mutated(draw: st.DrawFn, files: list[bytes]) -> bytes:
    """Return a file with some pieces removed, inserted or repeated."""
    data = draw(st.sampled_from(files))
    for _ in range(draw(st.integers(1, 5))):
        start = draw(st.integers(0, len(data)))
        end = draw(st.integers(start, min(len(data), start + 100)))
        piece = draw(st.sampled_from([*_PIECES, data[start:end] * 2]) | st.binary(max_size=8))
        data = data[:start] + piece + data[end:]
    return data


@pytest.mark.parametrize("parser", PARSERS)
@given(data=st.data())
def test_a_mutated_file_is_read_or_refused(parser: str, data: st.DataObject) -> None:
    PARSERS[parser](data.draw(mutated(seeds(parser))))


@pytest.mark.parametrize("parser", PARSERS)
@given(content=st.text() | st.binary())
def test_noise_is_read_or_refused(parser: str, content: str | bytes) -> None:
    data = content.encode("utf-8", "surrogatepass") if isinstance(content, str) else content
    PARSERS[parser](data)


@pytest.mark.parametrize("parser", REAL)
@given(data=st.data())
def test_a_mutated_file_of_the_real_world_is_read_or_refused(
    parser: str, data: st.DataObject, shared_data: Path
) -> None:
    PARSERS[parser](data.draw(mutated(shared_seeds(parser, shared_data))))
