"""The API as a process that is restarted whenever it ends, and a client that copes with that."""

from __future__ import annotations

import os
import socket
import threading
import time
from types import TracebackType
from typing import Any

import httpx

from service.jobs.supervisor import environment_of
from service.settings import Settings
from tests.service import prepared
from tests.service.prepared import Program

_PAUSE_S = 0.2


class Api:
    """One API process on one port, kept running."""

    def __init__(self, settings: Settings):
        with socket.socket() as probe:
            probe.bind(("127.0.0.1", 0))
            self._port = probe.getsockname()[1]
        self._environment = os.environ | environment_of(settings)
        self._process: Program | None = None
        self._stopping = threading.Event()
        self._thread = threading.Thread(target=self._keep_running, daemon=True)
        address = f"http://127.0.0.1:{self._port}"
        self._client = httpx.Client(base_url=address, timeout=60, trust_env=False)

    def __enter__(self) -> Api:
        self._thread.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self._stopping.set()
        self._thread.join()
        self.kill()
        self._client.close()

    def pid(self) -> int | None:
        """Return the id of the process, if there is one."""
        return None if self._process is None else self._process.pid

    def kill(self) -> None:
        """Send SIGKILL; the process is started again."""
        if self._process is not None:
            self._process.kill()
            self._process.wait()

    def post_job(self, body: dict[str, Any]) -> str:
        """Send a job until it is known to have been accepted, and return its id.

        A missing answer proves nothing: the job is searched for by its label before it is sent
        again.
        """
        while True:
            known = self.answered("GET", "/v1/jobs", params={"label": body["label"]})
            if known.json()["items"]:
                return str(known.json()["items"][0]["id"])
            answer = self._try("POST", "/v1/jobs", json=body)
            if answer is not None:
                assert answer.status_code == 202, answer.text
                return str(answer.json()["id"])

    def cancel(self, job_id: str) -> None:
        """Cancel a job, with as many attempts as it takes."""
        answer = self.answered("POST", f"/v1/jobs/{job_id}/cancel")
        if answer.status_code != 202:
            # The answer to an earlier attempt was lost, but it took effect.
            job = self.answered("GET", f"/v1/jobs/{job_id}").json()
            assert job["state"] in ("cancelling", "cancelled"), job

    def answered(self, method: str, path: str, **options: Any) -> httpx.Response:
        """Send a request until there is an answer."""
        while True:
            answer = self._try(method, path, **options)
            if answer is not None:
                return answer

    def _try(self, method: str, path: str, **options: Any) -> httpx.Response | None:
        try:
            answer = self._client.request(method, path, **options)
        except httpx.TransportError:
            time.sleep(_PAUSE_S)
            return None
        if answer.status_code == 503:
            time.sleep(_PAUSE_S)
            return None
        assert answer.status_code != 500, answer.text
        return answer

    def _keep_running(self) -> None:
        words = ["service", "api", "--port", str(self._port)]
        while not self._stopping.wait(_PAUSE_S):
            if self._process is None or self._process.poll() is not None:
                self._process = prepared.start(words, self._environment, stdout=1)
