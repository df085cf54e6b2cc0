"""The image and the compose file match what the program understands; checked without Docker."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest
import yaml

from service.commands.cli import _parser
from service.settings import Settings

ROOT = Path(__file__).resolve().parents[2]
DOCKER = ROOT / "docker"
SECRETS = {"POSTGRES_PASSWORD", "SLEWLINE_API_KEYS"}
OURS = ("migrate", "api", "worker")


def instructions() -> list[tuple[str, str]]:
    """Return the Dockerfile's instructions with their arguments, lines joined."""
    text = (DOCKER / "Dockerfile").read_text().replace("\\\n", " ")
    lines = [line for line in text.splitlines() if line and not line.startswith("#")]
    return [(word, rest) for word, _, rest in (line.partition(" ") for line in lines)]


def last_stage() -> list[tuple[str, str]]:
    found = instructions()
    start = max(place for place, (word, _) in enumerate(found) if word == "FROM")
    return found[start:]


@pytest.fixture(scope="module")
def compose() -> dict[str, Any]:
    loaded: dict[str, Any] = yaml.safe_load((DOCKER / "compose.yaml").read_text())
    return loaded


def variables(text: str) -> dict[str, str]:
    """Return the variables that compose substitutes, with what follows their names."""
    return dict(re.findall(r"\$\{(\w+)([^}]*)\}", text))


def test_every_file_that_the_image_copies_exists_and_is_not_ignored() -> None:
    allowed = {
        line[1:]
        for line in (DOCKER / "Dockerfile.dockerignore").read_text().splitlines()
        if line.startswith("!")
    }
    copied = {
        source
        for word, rest in instructions()
        if word == "COPY" and not rest.startswith("--from")
        for source in rest.split()[:-1]
    }
    assert copied == allowed
    for source in copied:
        assert (ROOT / source).exists(), source
    steps = [rest for word, rest in instructions() if word == "RUN" and "docker/install" in rest]
    assert [step.split()[1] for step in steps] == ["libraries", "program"]


def test_the_image_runs_the_program_as_an_ordinary_user_with_real_settings() -> None:
    stage = last_stage()
    by_word = dict(stage)
    assert by_word["USER"] == "10001:10001"
    after = [word for word, _ in stage[stage.index(("USER", by_word["USER"])) :]]
    assert "RUN" not in after
    settings = re.findall(r"SLEWLINE_(\w+)=", by_word["ENV"])
    assert settings
    assert {name.lower() for name in settings} <= set(Settings.model_fields)
    assert _parser().parse_args(yaml.safe_load(by_word["CMD"]))


def test_compose_names_real_settings_and_commands(compose: dict[str, Any]) -> None:
    for name in OURS:
        service = compose["services"][name]
        assert _parser().parse_args(service["command"])
        given = {key for key in service["environment"] if key.startswith("SLEWLINE_")}
        unknown = {key.removeprefix("SLEWLINE_").lower() for key in given} - set(
            Settings.model_fields
        )
        assert unknown == set()
        assert "SLEWLINE_DATABASE_URL" in given


def test_compose_has_no_secret_and_no_default_for_one() -> None:
    text = (DOCKER / "compose.yaml").read_text()
    found = variables(text)
    for secret in SECRETS:
        assert found[secret].startswith(":?"), secret
    lines = (DOCKER / "example.env").read_text().splitlines()
    assert {line for line in lines if line and not line.startswith("#")} == {
        f"{secret}=" for secret in SECRETS
    }
    told = {line.lstrip("#").partition("=")[0] for line in lines if "=" in line}
    assert set(found) <= told


def test_containers_of_ours_can_write_nothing_but_scratch(compose: dict[str, Any]) -> None:
    for name in OURS:
        service = compose["services"][name]
        assert service["read_only"] is True
        assert service["tmpfs"] == ["/tmp"]
        assert service["cap_drop"] == ["ALL"]
        assert "user" not in service


def test_nothing_starts_before_what_it_needs(compose: dict[str, Any]) -> None:
    services = compose["services"]
    assert services["database"]["healthcheck"]["test"][1] == "pg_isready"
    needs = {
        name: {on: how["condition"] for on, how in services[name]["depends_on"].items()}
        for name in OURS
    }
    migrated = {"migrate": "service_completed_successfully"}
    assert needs == {
        "migrate": {"database": "service_healthy"},
        "api": migrated,
        "worker": migrated,
    }
    assert "/health/live" in services["api"]["healthcheck"]["test"][-1]
    compile(services["api"]["healthcheck"]["test"][-1], "healthcheck", "exec")
    assert services["worker"]["stop_grace_period"] == "1m"
    assert set(compose["volumes"]) == {"database"}


def test_every_container_has_a_memory_limit_that_its_jobs_fit_into(compose: dict[str, Any]) -> None:
    limits = {name: service["mem_limit"] for name, service in compose["services"].items()}
    assert set(limits) == {"database", *OURS}
    defaults = {name: re.fullmatch(r"\$\{\w+:-(\d+)g\}", limit) for name, limit in limits.items()}
    assert all(defaults.values())
    worker = defaults["worker"]
    assert worker is not None
    asked = compose["services"]["worker"]["environment"]["SLEWLINE_MAX_MEMORY_MB"]
    (most_mb,) = re.findall(r":-(\d+)\}", asked)
    assert int(most_mb) + 500 <= 1000 * int(worker[1])


def test_base_images_are_fixed_by_digest(compose: dict[str, Any]) -> None:
    stages = [rest.split()[0] for word, rest in instructions() if word == "FROM"]
    assert stages == ["${PYTHON_IMAGE}"] * 2
    (build,) = {
        service["build"]["args"]["PYTHON_IMAGE"]
        for name, service in compose["services"].items()
        if name in OURS
    }
    (default,) = (rest for word, rest in instructions() if word == "ARG")
    python = default.partition("=")[2]
    assert variables(build) == {"PYTHON_IMAGE": f":-{python}"}
    database = variables(compose["services"]["database"]["image"])
    assert set(database) == {"POSTGRES_IMAGE"}
    for image in (python, database["POSTGRES_IMAGE"].removeprefix(":-")):
        assert re.fullmatch(r"[a-z]+:[\w.-]+@sha256:[0-9a-f]{64}", image), image
    told = (DOCKER / "example.env").read_text()
    assert "#POSTGRES_IMAGE=" in told
    assert "#PYTHON_IMAGE=" in told


def test_the_api_is_told_whose_forwarded_addresses_it_may_believe(compose: dict[str, Any]) -> None:
    assert variables(compose["services"]["api"]["environment"]["FORWARDED_ALLOW_IPS"]) == {
        "FORWARDED_ALLOW_IPS": ":-127.0.0.1"
    }
    assert "#FORWARDED_ALLOW_IPS=" in (DOCKER / "example.env").read_text()
