"""The table of formats: suffix, media type and writer of each."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

from service.answers.answered import Answered
from service.exports import calendar, czml, geojson, openmct, table


@dataclass(frozen=True, slots=True)
class Form:
    """A format other than the timeline document itself.

    Attributes
    ----------
    suffix
        Of the address and of files, without the leading dot.
    about
        Description for the OpenAPI document.
    has_own_type
        Whether ``Accept`` can select it; otherwise only the suffix does.
    """

    suffix: str
    media_type: str
    about: str
    write: Callable[[Answered], Iterator[str]]
    has_own_type: bool = True


FORMS: tuple[Form, ...] = (
    Form("csv", "text/csv", "one row for each action", table.write),
    Form(
        "geojson", "application/geo+json", "targets with outcome, ground tracks, stations",
        geojson.write,
    ),
    # CZML has no registered media type; Cesium does not require one.
    Form(
        "czml", "application/json", "satellites, targets and contacts for Cesium", czml.write,
        has_own_type=False,
    ),
    Form("ics", "text/calendar", "contacts with alarms", calendar.write),
    Form(
        "openmct.json", "application/json", "a plan file of Open MCT", openmct.write,
        has_own_type=False,
    ),
)  # fmt: skip
