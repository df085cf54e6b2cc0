"""The type of a file, recognised by its beginning."""

from __future__ import annotations

import pytest

from service.files.told import media_type_told
from tests.service.factories import tle

ELEMENTS = ("text/plain", "application/json", "text/csv", "application/xml", "text/xml")
TABLES = ("application/geo+json", "application/json", "text/csv")
SKIES = ("text/csv", "application/netcdf", "application/x-netcdf")


@pytest.mark.parametrize(
    ("text", "allowed", "told"),
    [
        ("\n".join(tle()), ELEMENTS, "text/plain"),
        ("A, B\n" + "\n".join(tle()), ELEMENTS, "text/plain"),
        ("CCSDS_OMM_VERS = 2.0\nNORAD_CAT_ID = 1\n", ELEMENTS, "text/plain"),
        ("OBJECT_NAME,EPOCH,MEAN_MOTION\nA,B,1\n", ELEMENTS, "text/csv"),
        ("object_name;norad_cat_id;epoch\n", ELEMENTS, "text/csv"),
        (" \n[{}]", ELEMENTS, "application/json"),
        ("<?xml version='1.0'?>", ELEMENTS, "application/xml"),
        ('{"name": "A", "targets": []}', TABLES, "application/json"),
        ('{"type": "FeatureCollection", "features": []}', TABLES, "application/geo+json"),
        ("name,lat,lon\n", TABLES, "text/csv"),
        ("", TABLES, "text/csv"),
        ("\x00\xff", TABLES, "text/csv"),
    ],
)
@pytest.mark.parametrize("coding", ["utf-8", "utf-8-sig", "utf-16"])
def test_a_file_tells_its_form(text: str, allowed: tuple[str, ...], told: str, coding: str) -> None:
    assert media_type_told(text.encode(coding), allowed) == told


def test_a_binary_file_is_netcdf_where_that_is_taken() -> None:
    assert media_type_told(b"\x89HDF\r\n\x1a\n", SKIES) == "application/netcdf"
    assert media_type_told(b"CDF\x01\x00", SKIES) == "application/netcdf"
    assert media_type_told(b"\x89HDF\r\n\x1a\n", TABLES) == "text/csv"
