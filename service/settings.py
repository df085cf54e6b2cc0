"""Every setting, read once from the environment (prefix ``SLEWLINE_``) and the command line."""

from __future__ import annotations

from pathlib import Path

import platformdirs
from pydantic import Field
from pydantic_settings import BaseSettings, SettingsConfigDict

from service.db.postgresql import DEFAULT_TIMEOUT_S


def default_database_url() -> str:
    """Return the SQLite file under the user's data directory."""
    folder = Path(platformdirs.user_data_dir("slewline"))
    return f"sqlite:///{folder / 'slewline.db'}"


class Settings(BaseSettings):
    """The configuration of every process of the service."""

    model_config = SettingsConfigDict(env_prefix="SLEWLINE_", frozen=True)

    database_url: str = Field(default_factory=default_database_url)
    database_timeout_s: float = Field(DEFAULT_TIMEOUT_S, gt=0, le=600)
    host: str = "127.0.0.1"
    port: int = Field(8000, ge=0, le=65535)
    workers: int = Field(2, ge=0, le=64)
    max_body_mb: float = Field(32.0, gt=0)
    max_horizon_days: float = Field(31.0, gt=0)
    lease_s: float = Field(15.0, gt=0)
    heartbeat_s: float = Field(0.5, gt=0)
    reconcile_s: float = Field(2.0, gt=0)
    max_attempts: int = Field(3, ge=1)
    default_time_s: float = Field(300.0, gt=0)
    max_time_s: float = Field(3600.0, gt=0)
    default_memory_mb: int = Field(2048, ge=64)
    queue_poll_s: float = Field(0.1, gt=0)
    max_queued: int = Field(10_000, ge=1)
    max_running_per_tenant: int = Field(64, ge=1)
    idempotency_hours: float = Field(24.0, gt=0, le=8760)
    otel: bool | None = None
