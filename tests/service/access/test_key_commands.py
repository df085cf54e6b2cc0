"""``slewline keys``, and serving other hosts once a key exists."""

from __future__ import annotations

import re
from pathlib import Path

import httpx
import pytest
import sqlalchemy as sa

from service.commands.cli import main
from service.commands.outcome import OK, WRONG_INPUT
from service.db.rows import AuditEventRow
from service.db.session import Database
from service.server import NoKey, require_key
from service.settings import Settings
from tests.service.problems import assert_problem
from tests.service.serving import serving


class Program:
    """The command line on one database."""

    def __init__(self, folder: Path, capsys: pytest.CaptureFixture[str]):
        self.url = f"sqlite:///{folder / 'slewline.db'}"
        self._capsys = capsys

    def run(self, *words: str) -> tuple[int, str, str]:
        status = main([*words, "--database-url", self.url])
        printed = self._capsys.readouterr()
        return status, printed.out, printed.err

    def create(self, scope: str = "submit", *more: str) -> str:
        words = ("--name", "robot", "--owner", "ops", "--scope", scope)
        status, out, _ = self.run("keys", "create", *words, *more)
        assert status == OK
        return out.strip()


@pytest.fixture
def program(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> Program:
    return Program(tmp_path, capsys)


def test_a_key_is_printed_once_alone_and_listed_without_its_secret(program: Program) -> None:
    token = program.create("read", "--expires-days", "30")
    assert re.fullmatch(r"slw_[0-9a-f]{12}_[0-9a-f]{48}", token)
    status, out, _ = program.run("keys", "list")
    assert status == OK
    assert token.rpartition("_")[2] not in out
    header, line = out.splitlines()
    assert header.split() == ["id", "name", "owner", "scope", "made", "expires", "state"]
    assert line.split()[:4] == [token.split("_")[1], "robot", "ops", "read"]
    assert line.split()[-1] == "good"


def test_a_key_is_revoked_by_its_id(program: Program) -> None:
    key_id = program.create().split("_")[1]
    assert program.run("keys", "revoke", key_id) == (OK, f"Key {key_id} is revoked.\n", "")
    assert "already" in program.run("keys", "revoke", key_id)[1]
    assert program.run("keys", "list")[1].split()[-1] == "revoked"
    status, _, said = program.run("keys", "revoke", "000000000000")
    assert status == WRONG_INPUT
    assert "there is no key '000000000000'" in said
    database = Database(program.url)
    with database.reading() as session:
        found = session.execute(
            sa.select(AuditEventRow.action, AuditEventRow.kind, AuditEventRow.owner).where(
                AuditEventRow.object_id == key_id
            )
        ).all()
    database.close()
    assert sorted(map(tuple, found)) == [
        ("create", "key", "command line"),
        ("revoke", "key", "command line"),
    ]


@pytest.mark.parametrize(
    "wrong",
    [
        ("--owner", "a b"),
        ("--name", ""),
        ("--scope", "write"),
        ("--expires-days", "0"),
        ("--expires-days", "4000"),
    ],
)
def test_a_wrong_key_is_not_made(program: Program, wrong: tuple[str, str]) -> None:
    with pytest.raises(SystemExit) as ended:
        program.create("read", *wrong)
    assert ended.value.code == WRONG_INPUT


def test_keys_that_are_no_longer_good_do_not_let_others_be_served(program: Program) -> None:
    program.run("keys", "revoke", program.create().split("_")[1])
    program.create("admin", "--expires-days", "1e-9")
    beyond = Settings(database_url=program.url, host="0.0.0.0")
    with pytest.raises(NoKey, match=r"0\.0\.0\.0 without a key"):
        require_key(beyond)
    program.create("read")
    require_key(beyond)


def test_with_a_key_the_service_listens_for_others_and_asks_for_it(
    program: Program, tmp_path: Path
) -> None:
    token = program.create("read")
    with serving(tmp_path, "api", "--host", "0.0.0.0") as (_, line):
        url = line.split()[-1].replace("0.0.0.0", "127.0.0.1")
        assert_problem(httpx.get(f"{url}/v1/jobs"), 401, "authentication_required")
        allowed = httpx.get(f"{url}/v1/jobs", headers={"Authorization": f"Bearer {token}"})
        assert allowed.json() == {"items": [], "next": None}
