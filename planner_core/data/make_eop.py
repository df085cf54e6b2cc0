"""Make ``eop.csv`` from the registry package astropy-iers-data.

    python -m venv /tmp/eop && /tmp/eop/bin/pip install astropy-iers-data
    /tmp/eop/bin/python planner_core/data/make_eop.py

The package carries ``finals2000A.all``, the daily Earth orientation of the IERS Rapid
Service (measured, then predicted for a year), and the list of leap seconds. We keep the days
from 2000 on, and only the values that move a satellite over the ground by a centimetre or more.
"""

from __future__ import annotations

from importlib.metadata import version
from importlib.resources import files
from pathlib import Path

FIRST_MJD = 51544  # 2000-01-01
OUT = Path(__file__).with_name("eop.csv")


def leap_seconds(text: str) -> list[tuple[int, int]]:
    """Return (MJD, TAI-UTC in seconds) from each leap second's day on."""
    rows = [line.split() for line in text.splitlines() if line.strip() and line[0] != "#"]
    return [(int(float(row[0])), int(row[4])) for row in rows]


def daily_rows(text: str, leaps: list[tuple[int, int]]) -> list[str]:
    """Return one CSV row per day that has a (measured or predicted) UT1."""
    rows = []
    for line in text.splitlines():
        mjd = int(float(line[7:15]))
        if mjd < FIRST_MJD or not line[58:68].strip():
            continue
        tai_utc_s = max(leap for leap in leaps if leap[0] <= mjd)[1]
        xp, yp, dut1 = float(line[18:27]), float(line[37:46]), float(line[58:68])
        rows.append(f"{mjd},{tai_utc_s},{dut1:.5f},{xp:.4f},{yp:.4f}")
    return rows


def main() -> None:
    """Write the table."""
    data = files("astropy_iers_data") / "data"
    leaps = leap_seconds((data / "Leap_Second.dat").read_text())
    rows = daily_rows((data / "finals2000A.all").read_text(), leaps)
    source = f"IERS finals2000A.all, by astropy-iers-data {version('astropy-iers-data')}"
    header = [
        f"# {source}; made by planner_core/data/make_eop.py",
        "mjd,tai_utc_s,dut1_s,xp_arcsec,yp_arcsec",
    ]
    OUT.write_text("\n".join([*header, *rows]) + "\n")


if __name__ == "__main__":
    main()
