"""No key appears in a log, in an error or in a request to workers."""

from __future__ import annotations

import json
import logging

import pytest

from service.access.static_keys import StaticKeys
from service.access.tokens import new_token
from service.commands.cli import main
from service.commands.outcome import WRONG_INPUT
from service.jobs.supervisor import environment_of
from service.process.logs import JsonFormatter
from service.settings import Settings
from tests.service.access.conftest import Door

SECRET = "q1" * 20


def record_of(message: str, **extra: object) -> logging.LogRecord:
    record = logging.LogRecord("n", logging.INFO, "p", 1, message, (), None)
    vars(record).update(extra)
    return record


def test_a_log_line_names_a_key_by_its_id_alone() -> None:
    key_id, token = new_token()
    try:
        raise ValueError(token)
    except ValueError as error:
        record = record_of(f"call with {token}!", path=f"/v1/jobs/{token}/x")
        record.exc_info = (type(error), error, error.__traceback__)
    line = JsonFormatter().format(record)
    secret = token.rpartition("_")[2]
    assert secret not in line
    assert json.loads(line)["message"] == f"call with slw_{key_id}_***!"


def test_a_request_is_logged_with_the_id_of_its_key(
    door: Door, caplog: pytest.LogCaptureFixture
) -> None:
    key = door.key("read", "science")
    with caplog.at_level(logging.INFO, "service.access"):
        door.client.get("/v1/jobs", headers=key | {"X-Request-ID": "this-one"})
        # The line is written after the answer is sent.
        door.jobs.until(lambda: "service.access" in [one.name for one in caplog.records])
    (record,) = [one for one in caplog.records if one.name == "service.access"]
    fields = json.loads(JsonFormatter().format(record))
    assert fields["owner"] == "science"
    assert fields["key_id"] in key["Authorization"]
    assert key["Authorization"].rpartition("_")[2] not in json.dumps(vars(record), default=str)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (f"a:read:{SECRET},b:write:{SECRET}", "entry 2 must be name:scope:token"),
        (SECRET, "entry 1 must be"),
        (f"a:read:{SECRET[:31]}", "entry 1 needs a token of 32"),
        (f"a:read:{SECRET} {SECRET}", "entry 1 needs a token"),
        (f"a:read:{SECRET},b:read:{SECRET}", "the same token"),
    ],
)
def test_a_wrong_list_of_keys_is_named_without_them(
    text: str, said: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("SLEWLINE_API_KEYS", text)
    assert main(["serve"]) == WRONG_INPUT
    printed = capsys.readouterr().err
    assert printed.startswith("slewline: SLEWLINE_API_KEYS: ")
    assert said in printed
    assert SECRET[:31] not in printed
    with pytest.raises(ValueError, match=r"entry \d|same token") as raised:
        Settings()
    assert SECRET[:31] not in str(raised.value)


def test_settings_show_no_key_and_tell_workers_none(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SLEWLINE_API_KEYS", f"robot:submit:{SECRET}")
    settings = Settings()
    assert settings.static_keys.find(SECRET) is not None
    assert SECRET not in repr(settings)
    assert SECRET not in repr(settings.static_keys)
    assert environment_of(settings)["SLEWLINE_API_KEYS"] == ""


def test_no_static_key_is_found_where_none_is_set() -> None:
    keys = StaticKeys.parse("")
    assert not keys
    assert keys.find("") is None
