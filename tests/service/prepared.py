"""Starts programs as forks of a process that has imported the service: in a tenth of the time.

Such a program is a process of its own that runs what ``python -m`` would run, with its own
arguments, environment and streams; it can be signalled, killed and waited for. Only imports are
shared, and done before any thread begins. The workers that it starts, and the processes from which
these fork their jobs, are forks too (``spare``). A program started with settings other than
Slewline's is started as a user would, since libraries may read theirs on import.
"""

from __future__ import annotations

import atexit
import json
import os
import select
import selectors
import signal
import socket
import subprocess
import sys
import threading
from collections.abc import Mapping, Sequence
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import IO, Any, Final, NoReturn
from uuid import uuid4

from service.process.imports import importing
from tests.service import spare

_ROOT: Final = Path(__file__).parents[2]
_NAME: Final = "SLEWLINE_TEST_PREPARED"


class Prepared:
    """A running program, with the parts of ``subprocess.Popen`` that tests need."""

    def __init__(self, pid: int, told: socket.socket, stdout: IO[str] | None) -> None:
        self.pid = pid
        self.stdout = stdout
        self.returncode: int | None = None
        self._told = told
        # The exit status is sent once, whoever waits for it: chaos waits in two threads.
        self._waiting = threading.Lock()

    def poll(self) -> int | None:
        """Return the exit status, or None while the program runs."""
        return self._status(0.0)

    def wait(self, timeout: float | None = None) -> int:
        """Return the exit status once the program has ended."""
        status = self._status(timeout)
        if status is None:
            raise subprocess.TimeoutExpired("a prepared program", timeout or 0.0)
        return status

    def send_signal(self, number: int) -> None:
        """Send a signal, unless the program has ended."""
        if self.poll() is None:
            with suppress(ProcessLookupError):
                os.kill(self.pid, number)

    def terminate(self) -> None:
        """Send SIGTERM."""
        self.send_signal(signal.SIGTERM)

    def kill(self) -> None:
        """Send SIGKILL."""
        self.send_signal(signal.SIGKILL)

    def _status(self, timeout_s: float | None) -> int | None:
        if not self._waiting.acquire(timeout=-1.0 if timeout_s is None else timeout_s):
            return self.returncode
        try:
            if self.returncode is None:
                self._told.settimeout(timeout_s)
                self.returncode = int(self._told.recv(32))
                self._told.close()
        except (BlockingIOError, TimeoutError):
            pass
        finally:
            self._waiting.release()
        return self.returncode


Program = Prepared | subprocess.Popen[str]


def start(
    words: Sequence[str],
    env: Mapping[str, str],
    *,
    stdout: int = subprocess.PIPE,
    stderr: int = 2,
    start_new_session: bool = False,
) -> Program:
    """Run ``python -m`` with these words.

    Parameters
    ----------
    env
        The whole environment.
    stdout, stderr
        Descriptors; the first may be ``subprocess.PIPE``.
    start_new_session
        As for ``subprocess.Popen``.
    """
    if sys.platform != "linux" or not _differs_in_own_settings_alone(env):
        command = [sys.executable, "-m", *words]
        return subprocess.Popen(
            command,
            env=env,
            stdout=stdout,
            stderr=stderr,
            text=True,
            start_new_session=start_new_session,
        )
    asked = {
        "words": list(words),
        "env": dict(env),
        "folder": os.getcwd(),
        "has_session": start_new_session,
    }
    if stdout != subprocess.PIPE:
        return _forked(asked, (stdout, stderr), None)
    read, write = os.pipe()
    try:
        return _forked(asked, (write, stderr), os.fdopen(read))
    finally:
        os.close(write)


def _forked(asked: dict[str, Any], streams: tuple[int, int], stdout: IO[str] | None) -> Prepared:
    told, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    server, _ = _server()
    with theirs:
        socket.send_fds(server, [json.dumps(asked).encode()], [theirs.fileno(), *streams])
    return Prepared(int(told.recv(32)), told, stdout)


def _differs_in_own_settings_alone(env: Mapping[str, str]) -> bool:
    _, environment = _server()
    names = {name for name, _ in env.items() ^ environment.items()}
    return all(name.startswith(("SLEWLINE_", "PYTEST_")) for name in names)


def share() -> None:
    """Start the process from which programs are forked, for this process and all its children."""
    os.environ[_NAME] = _begin()


@cache
def _server() -> tuple[socket.socket, dict[str, str]]:
    """Return a connection to the process from which programs are forked, and its environment."""
    environment = dict(os.environ)
    server = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    server.connect("\0" + (environment.get(_NAME) or _begin()))
    atexit.register(server.close)
    return server, environment


def _begin() -> str:
    """Start the process from which programs are forked; return the name at which it listens.

    It ends with this process.
    """
    name = f"slewline-{uuid4().hex}"
    with socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) as listener:
        listener.bind("\0" + name)
        listener.listen()
        # A test may have changed the folder before it starts its first program.
        process = subprocess.Popen(
            [sys.executable, "-m", __name__, str(listener.fileno())],
            stdin=subprocess.PIPE,
            pass_fds=[listener.fileno()],
            cwd=_ROOT,
        )

    def end() -> None:
        process.terminate()
        process.communicate()

    atexit.register(end)
    return name


# In the process from which programs are forked ------------------------------------------------


def main() -> None:
    """Import the service, and start requested programs until the end of the standard input.

    That ends with the process that began this one, even if by SIGKILL.
    """
    with importing():
        import service.commands.cli
        import service.commands.serving
        import service.heavy
        import service.jobs.worker
        import service.server
        from tests.service import application

        application.prepare_routes()
    # Otherwise each program would prepare its routes again, and its process for heavy work too.
    for module in (service.server, service.heavy):
        setattr(module, "create_app", application.new_app)  # noqa: B010 - no module declares it
    # Nobody waits for the processes that mind programs; Ctrl-C is for the programs.
    signal.signal(signal.SIGCHLD, signal.SIG_IGN)
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    listener = socket.socket(fileno=int(sys.argv[1]))
    listener.set_inheritable(False)
    _Forks(sys.stdin, listener).serve()


class _Forks:
    """Starts requested programs in this process, until the end of the first of some files.

    The others are a listener, or a requesting process.
    """

    def __init__(self, end: Any, *others: socket.socket) -> None:
        self._end = end
        self._selector = selectors.DefaultSelector()
        for each in (end, *others):
            self._selector.register(each, selectors.EVENT_READ)
        self._twin: socket.socket | None = None

    def serve(self) -> None:
        while True:
            for key, _ in self._selector.select():
                file: Any = key.fileobj
                if not isinstance(file, socket.socket):
                    return
                if file.getsockopt(socket.SOL_SOCKET, socket.SO_ACCEPTCONN):
                    self._selector.register(file.accept()[0], selectors.EVENT_READ)
                elif not self._start(file):
                    if file is self._end:
                        return
                    self._selector.unregister(file)
                    file.close()

    def _start(self, client: socket.socket) -> bool:
        """Start a requested program; return whether the requesting process still existed."""
        data, descriptors, _, _ = socket.recv_fds(client, spare.MOST_BYTES, 3)
        if not data:
            return False
        asked = json.loads(data)
        if self._end is sys.stdin and spare.has_plans(asked["words"]):
            socket.send_fds(self._with_kernels(descriptors), [data], descriptors)
        elif os.fork() == 0:
            self._close()
            _mind(asked, *descriptors)
        for descriptor in descriptors:
            os.close(descriptor)
        return True

    def _with_kernels(self, not_for_it: Sequence[int]) -> socket.socket:
        """Return a connection to a fork that has all kernels too, for programs that plan with them.

        Loading takes each of them half a second. Other programs must not hold unneeded kernels.
        """
        if self._twin is None:
            self._twin, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
            if os.fork() == 0:
                self._close()
                for descriptor in not_for_it:
                    os.close(descriptor)
                import service.jobs.preload  # noqa: F401

                _Forks(theirs).serve()
                os._exit(0)
            theirs.close()
        return self._twin

    def _close(self) -> None:
        """Close in a fork everything that only this process needs."""
        for key in self._selector.get_map().values():
            os.close(key.fd)
        self._selector.close()
        if self._twin is not None:
            self._twin.close()


def _mind(asked: dict[str, Any], told: int, stdout: int, stderr: int) -> NoReturn:
    """Start a program, send its process id, and later its exit status.

    If the requesting process ends first, so does this one. A worker is told that this one is
    its supervisor, so it ends as well.
    """
    signal.signal(signal.SIGCHLD, signal.SIG_DFL)
    words: list[str] = asked["words"]
    if "--supervisor" in words:
        words[words.index("--supervisor") + 1] = str(os.getpid())
    pid = os.fork()
    if pid == 0:
        os.close(told)
        _become(asked, stdout, stderr)
    os.close(stdout)
    os.close(stderr)
    os.write(told, str(pid).encode())
    program = os.pidfd_open(pid)
    if program in select.select([program, told], [], [])[0]:
        _, status = os.waitpid(pid, 0)
        with suppress(BrokenPipeError):
            os.write(told, str(os.waitstatus_to_exitcode(status)).encode())
    os._exit(0)


def _become(asked: dict[str, Any], stdout: int, stderr: int) -> NoReturn:
    """Run the program in this process, as ``python -m`` does."""
    nothing = os.open(os.devnull, os.O_RDONLY)
    for descriptor, number in ((nothing, 0), (stdout, 1), (stderr, 2)):
        os.dup2(descriptor, number)
        if descriptor > 2:
            os.close(descriptor)
    if asked["has_session"]:
        os.setsid()
    spare.run(asked["words"], asked["env"], asked["folder"])


if __name__ == "__main__":
    main()
