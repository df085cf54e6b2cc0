"""Any CSV: its encoding, its delimiter, and its decimal sign."""

from __future__ import annotations

import codecs
import csv
import io
import re
from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import dataclass
from typing import Final

from planner_core.errors import Fault

_COMMA: Final = ","
_OTHER_DELIMITERS: Final = (";", "\t")
_WIDE: Final = (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)
_DECIMAL_COMMA: Final = re.compile(r"([+-]?\d*),(\d+(?:[eE][+-]?\d+)?)", re.ASCII)


@dataclass(frozen=True, slots=True)
class Table:
    """Rows of cells, each with the line where it starts; blank lines are left out."""

    text: str
    delimiter: str

    @property
    def rows(self) -> Iterator[tuple[int, list[str]] | Fault]:
        """Yield the rows, and a fault for each malformed one."""
        reader = csv.reader(
            io.StringIO(self.text, newline=""), strict=True, delimiter=self.delimiter
        )
        while True:
            start = reader.line_num + 1
            try:
                cells = next(reader)
            except StopIteration:
                return
            except csv.Error as error:
                yield Fault(code="malformed_csv", detail=f"{str(error).capitalize()}.", row=start)
                continue
            if any(cell.strip() for cell in cells):
                yield start, cells

    def number(self, cell: str) -> str:
        """Return a cell with a point as its decimal sign.

        A comma counts only if it is not the delimiter and the only sign: ``1.234,5`` stays.

        >>> Table("", ";").number("-3,25"), Table("", ";").number("1.234,5")
        ('-3.25', '1.234,5')
        """
        match = None if self.delimiter == _COMMA else _DECIMAL_COMMA.fullmatch(cell)
        return cell if match is None else f"{match[1]}.{match[2]}"


def has_decimal_comma(cell: str) -> bool:
    """Return whether a cell may be a number whose decimal sign is a comma."""
    return _DECIMAL_COMMA.fullmatch(cell) is not None


def read_table(
    text: str, columns_of: Callable[[Sequence[str]], Collection[str]], required: Collection[str]
) -> Table:
    """Return the table in a text.

    Cells are separated by commas, unless the header has all required columns only with
    semicolons or tabs as delimiters.

    Parameters
    ----------
    columns_of
        Returns our names of the cells of a header.
    """
    comma = Table(text, _COMMA)
    for table in (comma, *(Table(text, delimiter) for delimiter in _OTHER_DELIMITERS)):
        header = next(table.rows, None)
        if isinstance(header, tuple) and set(required) <= set(columns_of(header[1])):
            return table
    return comma


def decoded(data: bytes) -> str | Fault:
    """Return the text of a file: UTF-8, or UTF-16 if its first bytes say so."""
    try:
        return data.decode("utf-16" if data.startswith(_WIDE) else "utf-8-sig")
    except UnicodeDecodeError as error:
        detail = (
            f"Byte {error.start} is not UTF-8. Save the file as UTF-8, which most programs offer."
        )
        return Fault(code="not_utf8", detail=detail)
