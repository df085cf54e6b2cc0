"""Every kind of problem the service answers with: status, title, and what to do about it."""

from __future__ import annotations

from dataclasses import dataclass

from planner_core.errors import Fault
from service.problems.elements import ELEMENT_PROBLEMS


@dataclass(frozen=True, slots=True)
class ProblemKind:
    """A row of the table that ``GET /problems/{code}`` explains."""

    status: int
    title: str
    explanation: str


class ServiceError(Exception):
    """An error of the service itself, as opposed to one of the planner.

    Parameters
    ----------
    code
        A key of ``KINDS``; gives the status.
    detail
        One sentence for people.
    faults
        Places in the body or file, where there are any.
    headers
        Extra response headers, such as ``Retry-After``.
    """

    def __init__(
        self,
        code: str,
        detail: str,
        *,
        faults: tuple[Fault, ...] = (),
        headers: dict[str, str] | None = None,
    ):
        super().__init__(detail)
        self.code = code
        self.detail = detail
        self.faults = faults
        self.headers = headers or {}


KINDS: dict[str, ProblemKind] = {
    "authentication_required": ProblemKind(
        401,
        "Key required",
        "Send a key as Authorization: Bearer <key> or as X-API-Key. slewline keys create makes "
        "one.",
    ),
    "invalid_key": ProblemKind(
        401, "Invalid key", "The key is mistyped, has expired or was revoked; ask for a new one."
    ),
    "insufficient_scope": ProblemKind(
        403,
        "Insufficient scope",
        "Keys are made to read, to submit or to administrate; the detail names the scope needed.",
    ),
    "foreign_origin": ProblemKind(
        403,
        "Page of another site",
        "Without a key, only pages of the sites in SLEWLINE_CORS_ORIGINS may change anything.",
    ),
    "rate_limited": ProblemKind(
        429,
        "Too many requests",
        "Wait for Retry-After seconds; SLEWLINE_RATE_LIMIT_PER_S and _BURST set the limit.",
    ),
    "not_found": ProblemKind(
        404, "Not found", "Nothing is stored under this address, or it has been deleted."
    ),
    "method_not_allowed": ProblemKind(
        405, "Method not allowed", "The address exists; the Allow header lists its methods."
    ),
    "not_acceptable": ProblemKind(
        406, "Not acceptable", "The answer is not offered in a form that the request accepts."
    ),
    "not_ready": ProblemKind(
        409, "Not ready", "The job has no answer yet; poll the job, or ask it to wait."
    ),
    "invalid_transition": ProblemKind(
        409, "Not possible in this state", "The detail lists what the job's state allows."
    ),
    "precondition_failed": ProblemKind(
        412,
        "Precondition failed",
        "It is no longer what If-Match names: read it again, and decide anew.",
    ),
    "body_too_large": ProblemKind(
        413, "Body too large", "Split the body, or raise SLEWLINE_MAX_BODY_MB on the server."
    ),
    "unsupported_media_type": ProblemKind(
        415, "Unsupported media type", "Set Content-Type to one of the types the detail names."
    ),
    "invalid_request": ProblemKind(
        422, "Invalid request", "Several things are wrong; each entry of errors names one."
    ),
    "malformed_json": ProblemKind(422, "Malformed JSON", "The body is not one JSON document."),
    "malformed_csv": ProblemKind(422, "Malformed CSV", "The body cannot be read as CSV."),
    "malformed_geojson": ProblemKind(
        422, "Malformed GeoJSON", "The body is not a FeatureCollection of points (RFC 7946)."
    ),
    "not_utf8": ProblemKind(422, "Not UTF-8", "Text must be UTF-8, with or without a BOM."),
    "empty_file": ProblemKind(422, "Empty file", "The file holds no records."),
    "missing_field": ProblemKind(422, "Missing field", "A required field or column is absent."),
    "unknown_field": ProblemKind(
        422, "Unknown field", "The field or column does not exist; check its spelling."
    ),
    "unknown_parameter": ProblemKind(
        422, "Unknown query parameter", "The call has no query parameter of this name."
    ),
    "invalid_value": ProblemKind(422, "Invalid value", "The value has the wrong type or form."),
    "unknown_value": ProblemKind(
        422, "Unknown value", "The value is none of those that the field allows."
    ),
    "not_finite": ProblemKind(422, "Not a finite number", "NaN and infinity are refused."),
    "value_out_of_range": ProblemKind(
        422, "Value out of range", "The detail names the value's limits."
    ),
    "naive_time": ProblemKind(
        422, "Time without zone", "End the instant in Z, or give its offset from UTC."
    ),
    "invalid_time": ProblemKind(
        422, "Invalid time", "Instants are RFC 3339, for example 2026-01-31T12:00:00.000Z."
    ),
    "invalid_cursor": ProblemKind(
        422, "Invalid cursor", "Cursors are opaque: take them from next, with the same filters."
    ),
    "too_many_rows": ProblemKind(422, "Too many rows", "Split the file into several."),
    "too_many_errors": ProblemKind(
        422,
        "Too many errors",
        "It is probably another kind of file than it says; see the first.",
    ),
    "too_many_fields": ProblemKind(
        422, "Too many fields", "An object of a body has far more fields than any has here."
    ),
    "horizon_inverted": ProblemKind(
        422, "Horizon inverted", "The horizon must end later than it starts."
    ),
    "horizon_too_long": ProblemKind(
        422, "Horizon too long", "Plan a shorter span, or raise SLEWLINE_MAX_HORIZON_DAYS."
    ),
    "scenario_too_large": ProblemKind(
        422,
        "Scenario too large",
        "Plan fewer satellites, targets or days, or raise SLEWLINE_MAX_TARGETS or "
        "SLEWLINE_MAX_SATELLITE_TARGET_DAYS.",
    ),
    "too_many_opportunities": ProblemKind(
        422,
        "Too many opportunities",
        "Plan fewer satellites, targets or days, or give a longer collect_spacing_s.",
    ),
    "unknown_satellite": ProblemKind(422, "Unknown satellite", "No satellite has this id."),
    "unknown_target_catalog": ProblemKind(
        422, "Unknown target catalogue", "No target catalogue has this id."
    ),
    "unknown_ground_station": ProblemKind(
        422, "Unknown ground station", "No ground station has this id."
    ),
    "unknown_scenario": ProblemKind(422, "Unknown scenario", "No scenario has this id."),
    "unknown_solver": ProblemKind(422, "Unknown solver", "GET /v1/solvers lists the solvers."),
    "unknown_parameter_of_solver": ProblemKind(
        422, "Unknown solver parameter", "GET /v1/solvers/{name} lists the parameters."
    ),
    "duplicate_target_id": ProblemKind(
        422,
        "Duplicate target id",
        "Target ids are unique within a catalogue and over the catalogues of a scenario.",
    ),
    "different_satellite": ProblemKind(
        422, "Another satellite", "The elements have another catalogue number than the satellite."
    ),
    "duplicate_satellite_id": ProblemKind(
        422, "Duplicate satellite id", "A scenario names each satellite once."
    ),
    "duplicate_target_catalog_id": ProblemKind(
        422, "Duplicate target catalogue id", "A scenario names each catalogue once."
    ),
    "duplicate_ground_station_id": ProblemKind(
        422, "Duplicate ground station id", "A scenario names each ground station once."
    ),
    "propagation_failed": ProblemKind(
        422,
        "Propagation failed",
        "SGP4 cannot carry this orbit through the horizon: the satellite has decayed by then, "
        "or its elements are too old or wrong. The detail has SGP4's code.",
    ),
    "elements_too_old": ProblemKind(
        422,
        "Elements too old",
        "At some time of the horizon a satellite in low orbit is more than 30 days from the epoch "
        "of its element set. Give newer elements, or allow_old_elements.",
    ),
    "unknown_target": ProblemKind(422, "Unknown target", "The scenario has no target of this id."),
    "unknown_action": ProblemKind(
        422, "Unknown action", "The job's timeline has no collect or contact of this id."
    ),
    "pin_without_opportunity": ProblemKind(
        422,
        "Nothing to be kept",
        "No opportunity is what the pin names. GET /v1/scenarios/{id}/opportunities lists them.",
    ),
    "pin_ambiguous": ProblemKind(
        422, "Ambiguous pin", "Several opportunities are what the pin names: give its start."
    ),
    "pins_conflict": ProblemKind(
        422,
        "Pins exclude each other",
        "No plan can honour this pin together with another one; the detail says which and why.",
    ),
    "pin_breaks_limits": ProblemKind(
        422,
        "A pin breaks the limits",
        "Whatever else is planned, battery or recorder would reach its limit.",
    ),
    "idempotency_key_reused": ProblemKind(
        422, "Idempotency key reused", "The key was used for another request; choose a new one."
    ),
    "internal_error": ProblemKind(
        500, "Internal error", "A fault of the service. Its log has the request_id."
    ),
    "webhook_address_refused": ProblemKind(
        422,
        "Webhook address refused",
        "Webhooks go to https addresses of the public internet. Who runs the service may allow "
        "others with SLEWLINE_WEBHOOK_PRIVATE_ADDRESSES=true.",
    ),
    "too_many_webhooks": ProblemKind(
        422, "Too many webhooks", "Delete one that is no longer needed."
    ),
    "webhook_disabled": ProblemKind(
        409, "Webhook disabled", "Its receiver answered 410 Gone. Make a new webhook to go on."
    ),
    "queue_full": ProblemKind(
        503, "Queue full", "Too many jobs are waiting; try again after Retry-After seconds."
    ),
    "database_unavailable": ProblemKind(
        503,
        "Database unavailable",
        "The database is away, full, read-only or too busy; the detail says which. Try again "
        "after Retry-After seconds, and look at its disk if that does not help.",
    ),
    "not_live": ProblemKind(
        503, "Not ready to serve", "The database or every worker is away; the detail says which."
    ),
    "still_computing": ProblemKind(
        503, "Still computing", "The answer is being prepared; ask again after Retry-After."
    ),
} | {
    code: ProblemKind(422, title, explanation)
    for code, (title, explanation) in ELEMENT_PROBLEMS.items()
}
"""All codes. `kind_of` also serves one that is missing here: as data that is wrong, 422."""


def kind_of(code: str) -> ProblemKind:
    """Return the kind of a code.

    >>> kind_of("tle_checksum").title
    'TLE checksum mismatch'
    """
    known = KINDS.get(code)
    if known is not None:
        return known
    title = code.replace("_", " ").capitalize()
    return ProblemKind(422, title, "The data is wrong in the place that the problem names.")
