"""docs/deploy.md lists every setting with its default, and no other."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from pydantic import SecretStr

from service.commands.cli import _parser
from service.settings import Settings

ROOT = Path(__file__).resolve().parents[2]
TEXT = (ROOT / "docs" / "deploy.md").read_text()
ROWS = dict(re.findall(r"^\| `SLEWLINE_(\w+)` \| ([^|]+) \|", TEXT, re.MULTILINE))
IN_WORDS = {"database_url", "otel", "rate_limit_per_s", "retention_days", "solver_threads"}


def test_the_table_has_every_setting_and_no_other() -> None:
    assert {name.lower() for name in ROWS} == set(Settings.model_fields)


@pytest.mark.parametrize("name", sorted(set(Settings.model_fields) - IN_WORDS))
def test_the_table_tells_the_default(name: str) -> None:
    default = Settings.model_fields[name].default
    if isinstance(default, SecretStr):
        default = default.get_secret_value()
    told = ROWS[name.upper()]
    assert told == (str(default).lower() if isinstance(default, bool) else str(default) or "none")


def test_the_commands_exist_and_the_files_too() -> None:
    for command in set(re.findall(r"`slewline ([a-z]+)", TEXT)):
        with pytest.raises(SystemExit) as ended:
            _parser().parse_args([command, "--help"])
        assert ended.value.code == 0, command
    for file in set(re.findall(r"docker/[a-zA-Z.]+", TEXT)) - {"docker/.env"}:
        assert (ROOT / file).exists(), file
    for page in set(re.findall(r"\]\((\w+\.md)\)", TEXT)):
        assert (ROOT / "docs" / page).exists(), page
