"""Working bodies for the OpenAPI document, one for each shape and kind of file that is sent.

Ids are made up; everything else can be sent unchanged.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

_ID: Final = "01a1fff4-8aa0-7cb7-ae14-b8314cbfffc2"
_OMM: Final = {
    "NORAD_CAT_ID": 99001,
    "EPOCH": "2019-01-01T00:00:00",
    "MEAN_MOTION": 15.24162312,
    "ECCENTRICITY": 0.001,
    "INCLINATION": 90,
    "RA_OF_ASC_NODE": 0,
    "ARG_OF_PERICENTER": 0,
    "MEAN_ANOMALY": 0,
    "BSTAR": 0,
}
_HORIZON: Final = {"start": "2019-01-01T00:00:00Z", "end": "2019-01-01T12:00:00Z"}

BODIES: Final[dict[str, Any]] = {
    "SatelliteIn": {"name": "Polar-500", "omm": _OMM},
    "SpacecraftIn": {"name": "Our bus", "agility": {"slew_rate_deg_s": 2.0}},
    "SpacecraftPatch": {"sensor": {"off_nadir_max_deg": 40.0}},
    "OrbitIn": {"omm": _OMM | {"EPOCH": "2019-01-01T06:00:00", "MEAN_ANOMALY": 92}},
    "GroundStationIn": {"name": "Svalbard", "lat_deg": 78.22983, "lon_deg": 15.39244},
    "SatellitePatch": {"agility": {"slew_rate_deg_s": 2.0, "settle_s": 5.0}},
    "GroundStationPatch": {"min_elevation_deg": 10.0},
    "TargetCatalogIn": {
        "name": "Two cities",
        "targets": [
            {"id": "bern", "lat_deg": 46.948, "lon_deg": 7.447},
            {"id": "quito", "lat_deg": -0.22, "lon_deg": -78.512, "reward": 2.0},
        ],
    },
    "ScenarioIn": {
        "horizon": _HORIZON,
        "satellite_ids": [_ID],
        "target_catalog_ids": [_ID],
        "ground_station_ids": [_ID],
    },
    "JobIn": {"scenario_id": _ID, "solver": "rule", "label": "first try"},
    "ComparisonIn": {
        "scenario_id": _ID,
        "runs": [{"solver": "rule"}, {"solver": "forward_search", "params": {"depth": 2}}],
    },
    "WhatIfIn": {"forbid": ["bern"], "relax": {"slew_rate_deg_s": 2.0}},
    "OutageIn": {"satellite_id": _ID, **_HORIZON, "modes": ["collect"], "reason": "safe mode"},
    "PlanIn": {"job_id": _ID, "name": "Monday"},
    "TransitionIn": {"to": "approved", "reason": "Checked by the shift lead."},
    "ReplanIn": {
        "now": "2026-03-01T09:12:00Z",
        "freeze_until": "2026-03-01T09:30:00Z",
        "promises": [{"target_id": "bern"}],
    },
    "TargetCatalogPatch": {"rewards": {"bern": 5}},
    "WebhookIn": {"url": "https://ops.example/slewline", "events": ["job.succeeded"]},
}
"""Examples by the name of the schema."""

_EXECUTIONS: Final = [{"action_id": "a2", "outcome": "executed", "mbit": 120.5}]
"""Execution reports of a plan."""

_STATES: Final = [
    {"satellite_id": _ID, "at": "2019-01-01T06:00:00Z", "battery_fraction": 0.82,
     "recorder_fraction": 0.31}
]  # fmt: skip
"""Telemetry of a plan's satellites."""

_FEATURES: Final = {
    "type": "FeatureCollection",
    "features": [
        {
            "type": "Feature",
            "id": "bern",
            "geometry": {"type": "Point", "coordinates": [7.447, 46.948]},
            "properties": {"name": "Bern"},
        }
    ],
}
_TLE: Final = """POLAR-500
1 99001U 19001A   19001.00000000  .00000000  00000+0  00000+0 0  9999
2 99001  90.0000   0.0000 0010000   0.0000   0.0000 15.24162312    08
"""

_METADATA: Final = {
    "CENTER_NAME": "EARTH",
    "REF_FRAME": "TEME",
    "TIME_SYSTEM": "UTC",
    "MEAN_ELEMENT_THEORY": "SGP4",
}
_OF_TLES: Final = ("NORAD_CAT_ID", "BSTAR")


def _elements(values: Mapping[str, object]) -> str:
    return "".join(f"<{key}>{value}</{key}>" for key, value in values.items())


FILES: Final[dict[tuple[str, str], Any]] = {
    ("/v1/satellites/import", "text/plain"): _TLE,
    ("/v1/satellites/import", "application/json"): [_OMM],
    ("/v1/satellites/import", "text/csv"): "\n".join(
        [",".join(_OMM), ",".join(str(value) for value in _OMM.values())]
    ),
    ("/v1/satellites/import", "application/xml"): (
        '<omm id="CCSDS_OMM_VERS" version="3.0"><body><segment><metadata>'
        + _elements(_METADATA)
        + "</metadata><data><meanElements>"
        + _elements({key: value for key, value in _OMM.items() if key not in _OF_TLES})
        + "</meanElements><tleParameters>"
        + _elements({key: _OMM[key] for key in _OF_TLES})
        + "</tleParameters></data></segment></body></omm>"
    ),
    ("/v1/ground-stations/import", "application/geo+json"): _FEATURES,
    ("/v1/ground-stations/import", "text/csv"): (
        "name,lat_deg,lon_deg,min_elevation_deg\nTromsø,69.66,18.94,5\n"
    ),
    ("/v1/forecasts", "text/csv"): (
        "time,lat_deg,lon_deg,clear_probability\n"
        "2026-01-31T00:00:00Z,46,7,0.8\n2026-01-31T00:00:00Z,46,8,0.7\n"
        "2026-01-31T00:00:00Z,47,7,0.5\n2026-01-31T00:00:00Z,47,8,0.4\n"
    ),
    ("/v1/plans/{plan_id}/executions", "application/json"): _EXECUTIONS,
    ("/v1/plans/{plan_id}/executions", "text/csv"): "action_id,outcome,mbit\na2,executed,120.5\n",
    ("/v1/plans/{plan_id}/states", "application/json"): _STATES,
    ("/v1/plans/{plan_id}/states", "text/csv"): (
        "satellite_id,at,battery_fraction\n"
        f"{_STATES[0]['satellite_id']},{_STATES[0]['at']},{_STATES[0]['battery_fraction']}\n"
    ),
    ("/v1/target-catalogs", "application/geo+json"): _FEATURES,
    ("/v1/target-catalogs", "text/csv"): "id,lat_deg,lon_deg,reward\nbern,46.948,7.447,1\n",
}
"""Examples by path and media type."""


def add_examples(document: dict[str, Any]) -> None:
    """Add the examples to the schemas of the document."""
    schemas = document["components"]["schemas"]
    for name, body in BODIES.items():
        schemas[name]["examples"] = [body]
    for (path, media_type), body in FILES.items():
        content = document["paths"][path]["post"]["requestBody"]["content"]
        content[media_type]["schema"]["examples"] = [body]
