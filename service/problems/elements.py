"""What can be wrong with element sets, as problems: the codes of `planner_core.orbits`."""

from __future__ import annotations

ELEMENT_PROBLEMS = {
    "tle_checksum": (
        "TLE checksum mismatch",
        "A digit of the line is wrong or lost; fetch the element set again.",
    ),
    "tle_columns": ("TLE columns wrong", "Every field has its own columns; one is filled wrongly."),
    "tle_epoch": ("TLE epoch wrong", "Line 1 holds a day that its year does not have."),
    "tle_line_length": ("TLE line too short or long", "A line of an element set has 69 columns."),
    "tle_line_number": ("TLE line number wrong", "Element lines start with 1 and with 2."),
    "tle_line_order": ("TLE lines swapped", "Line 1 stands before line 2."),
    "tle_missing_line": ("TLE line missing", "An element set has a line 1 and a line 2."),
    "tle_name": ("TLE name unusable", "The name line holds characters that are no text."),
    "tle_normalised": (
        "TLE put right",
        "A warning: blanks were read as zeros and the checksum recomputed.",
    ),
    "tle_not_ascii": ("TLE not ASCII", "Element lines hold plain ASCII characters only."),
    "tle_number_format": ("TLE number unreadable", "A field holds something that is no number."),
    "tle_number_mismatch": (
        "TLE numbers differ",
        "Line 1 and line 2 name different satellites; they do not belong together.",
    ),
    "tle_tabs": ("TLE with tabs", "Tabs shift the fixed columns; use blanks."),
    "omm_missing_key": ("OMM keyword missing", "SGP4 needs this keyword."),
    "omm_number_format": ("OMM number unreadable", "The value of the keyword is no number."),
    "omm_epoch": ("OMM epoch unreadable", "Write EPOCH as 2026-01-31T12:00:00.000000, in UTC."),
    "omm_text": ("OMM text unusable", "The value is too long or no printable text."),
    "omm_syntax": ("OMM syntax wrong", "The line or element does not follow CCSDS 502.0-B."),
    "omm_unknown_keyword": ("OMM keyword unknown", "The keyword is not one of CCSDS 502.0-B."),
    "omm_duplicate_key": ("OMM keyword repeated", "A message gives each keyword once."),
    "omm_unit": ("OMM unit wrong", "The unit in brackets is not that of the keyword."),
    "csv_columns": ("CSV cells do not fit", "The line has more or fewer cells than the header."),
    "duplicate_element_set": (
        "Element set repeated",
        "A satellite and epoch occur twice in the file; the first is kept.",
    ),
    "no_elements": ("No element sets", "The file holds no element set."),
    "not_csv": ("Not CSV", "The file cannot be read as CSV."),
    "not_json": ("Not JSON", "The file cannot be read as JSON."),
    "not_xml": ("Not XML", "The file cannot be read as XML."),
    "xml_forbidden": ("XML forbidden", "Entities and document types are refused."),
    "unsupported_message": ("Message not supported", "Only OMM is read, no other CCSDS message."),
    "unsupported_version": ("OMM version not supported", "Versions 2.0 and 3.0 are read."),
    "unsupported_theory": ("Theory not supported", "Only SGP4 mean elements are propagated."),
    "unsupported_frame": ("Frame not supported", "SGP4 mean elements stand in TEME."),
    "unsupported_time_system": ("Time system not supported", "Epochs are in UTC."),
    "unsupported_center": ("Centre not supported", "Only orbits round the Earth are planned."),
}
"""Code: title and explanation; each is a 422."""
