"""All settings, read once from the environment (prefix ``SLEWLINE_``) and the command line."""

from __future__ import annotations

import ipaddress
import os
import re
import socket
from pathlib import Path
from typing import Final

import platformdirs
from pydantic import Field, SecretStr, field_serializer, field_validator
from pydantic_settings import BaseSettings, SettingsConfigDict

from service.access.static_keys import StaticKeys
from service.db.timeouts import DEFAULT_TIMEOUT_S
from service.scenarios.scenario_limits import ScenarioLimits

_REQUESTS_PER_S: Final = 50.0
_ORIGIN = re.compile(r"https?://[A-Za-z0-9.-]+(:\d+)?|https?://\[[0-9A-Fa-f:]+\](:\d+)?")


def default_database_url() -> str:
    """Return the SQLite file under the user's data directory."""
    folder = Path(platformdirs.user_data_dir("slewline"))
    return f"sqlite:///{folder / 'slewline.db'}"


class Settings(BaseSettings):
    """The configuration of every process of the service."""

    model_config = SettingsConfigDict(
        env_prefix="SLEWLINE_", frozen=True, hide_input_in_errors=True
    )

    database_url: str = Field(default_factory=default_database_url)
    database_timeout_s: float = Field(DEFAULT_TIMEOUT_S, gt=0, le=600)
    host: str = "127.0.0.1"
    port: int = Field(8000, ge=0, le=65535)
    workers: int = Field(2, ge=0, le=64)
    max_body_mb: float = Field(32.0, gt=0)
    max_horizon_days: float = Field(31.0, gt=0)
    max_targets: int = Field(200_000, ge=1)
    max_satellite_target_days: float = Field(20e6, gt=0)
    lease_s: float = Field(15.0, gt=0)
    heartbeat_s: float = Field(0.5, gt=0)
    reconcile_s: float = Field(2.0, gt=0)
    max_attempts: int = Field(3, ge=1)
    default_time_s: float = Field(300.0, gt=0)
    max_time_s: float = Field(3600.0, gt=0)
    default_memory_mb: int = Field(2048, ge=64)
    max_memory_mb: int = Field(16_384, ge=64)
    solver_threads: int | None = Field(None, ge=1, le=64)
    queue_poll_s: float = Field(0.1, gt=0)
    heavy_memory_mb: int = Field(2048, ge=256)
    max_queued: int = Field(10_000, ge=1)
    max_queued_per_tenant: int = Field(1000, ge=1)
    max_running_per_tenant: int = Field(64, ge=1)
    max_rows_per_tenant: int = Field(20_000_000, ge=1)
    max_stored_mb_per_tenant: float = Field(20_000.0, gt=0)
    webhook_private_addresses: bool = False
    idempotency_hours: float = Field(24.0, gt=0, le=8760)
    retention_days: float | None = Field(None, gt=0, le=36500)
    otel: bool | None = None
    require_keys: bool = False
    api_keys: SecretStr = SecretStr("")
    rate_limit_per_s: float | None = Field(None, ge=0, allow_inf_nan=False)
    rate_limit_burst: int = Field(200, ge=1)
    cors_origins: str = ""
    allowed_hosts: str = ""

    @property
    def scenario_limits(self) -> ScenarioLimits:
        """Return the limits on the size of a scenario."""
        return ScenarioLimits(
            horizon_days=self.max_horizon_days,
            num_targets=self.max_targets,
            satellite_target_days=self.max_satellite_target_days,
        )

    @property
    def threads_per_job(self) -> int:
        """Return how many threads a solver may use."""
        return self.solver_threads or max(1, (os.cpu_count() or 1) // max(1, self.workers))

    @property
    def is_local(self) -> bool:
        """Return whether only this machine can reach the server."""
        if self.host == "localhost":
            return True
        try:
            return ipaddress.ip_address(self.host).is_loopback
        except ValueError:
            return False

    @property
    def keys_required(self) -> bool:
        """Return whether callers must show a key; always if other machines can reach the server."""
        return self.require_keys or not self.is_local

    @property
    def static_keys(self) -> StaticKeys:
        """Return the keys in ``api_keys``."""
        return StaticKeys.parse(self.api_keys.get_secret_value())

    @property
    def requests_per_s(self) -> float:
        """Return how many requests per second a caller may make; 0 for no limit."""
        if self.rate_limit_per_s is None:
            return 0.0 if self.is_local else _REQUESTS_PER_S
        return self.rate_limit_per_s

    @property
    def allowed_origins(self) -> tuple[str, ...]:
        """Return the sites whose pages may call the service from a browser."""
        return tuple(self.cors_origins.replace(",", " ").split())

    @property
    def own_hosts(self) -> frozenset[str]:
        """Return the host names under which the service is called, in lower case; "*" for any.

        IP addresses need not be listed: a page whose own name resolves here sends its own name.
        """
        own = f"localhost {self.host} {socket.gethostname()} {self.allowed_hosts}"
        return frozenset(own.lower().replace(",", " ").split())

    @field_validator("api_keys")
    @classmethod
    def _check_keys(cls, value: SecretStr) -> SecretStr:
        StaticKeys.parse(value.get_secret_value())
        return value

    @field_validator("cors_origins")
    @classmethod
    def _check_origins(cls, value: str) -> str:
        for origin in value.replace(",", " ").split():
            if not _ORIGIN.fullmatch(origin):
                raise ValueError(f"{origin!r} is not an origin such as https://ops.example")
        return value

    @field_serializer("api_keys")
    def _keep(self, _value: SecretStr) -> str:
        """Keep the keys from workers, which nobody calls."""
        return ""
