"""The table of forms: suffix, media type and writer of each."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

from service.answers.answered import Answered
from service.exports import calendar, czml, geojson, openmct, table


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
        suffix="csv",
        media_type="text/csv",
        about="one row for each action",
        write=table.write,
    ),
    Form(
        suffix="geojson",
        media_type="application/geo+json",
        about="targets with outcome, ground tracks, stations",
        write=geojson.write,
    ),
    Form(
        suffix="czml",
        media_type="application/json",  # CZML has no registered type; Cesium asks for none
        about="satellites, targets and contacts for Cesium",
        write=czml.write,
        has_own_type=False,
    ),
    Form(
        suffix="ics",
        media_type="text/calendar",
        about="contacts with alarms",
        write=calendar.write,
    ),
    Form(
        suffix="openmct.json",
        media_type="application/json",
        about="a plan file of Open MCT",
        write=openmct.write,
        has_own_type=False,
    ),
)
