"""The table of forms: suffix, media type and writer of each."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

from service.exports import geojson
from service.exports.answered import Answered


@dataclass(frozen=True, slots=True, kw_only=True)
class Form:
    """A form other than the timeline document itself.

    Attributes
    ----------
    suffix
        Of the address and of files, without the leading dot.
    about
        What it is, for the OpenAPI document.
    has_own_type
        Whether ``Accept`` can ask for it; otherwise only the suffix does.
    """

    suffix: str
    media_type: str
    about: str
    write: Callable[[Answered], Iterator[str]]
    has_own_type: bool = True


FORMS: tuple[Form, ...] = (
    Form(
        suffix="geojson",
        media_type="application/geo+json",
        about="targets with outcome, ground tracks, stations",
        write=geojson.write,
    ),
)
