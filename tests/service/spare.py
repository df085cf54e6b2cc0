"""Runs programs in a fork of a process that has imported the service; their children are forks too.

A worker, and the fork server of its jobs, are separate programs that import nearly everything that
their parent has already imported. So a program that will start them first forks a spare process for
each, while it has one thread and no open file. The spare waits for its words, its environment and
its descriptors, and becomes the program to start: a child of the parent, with the same descriptors
at the same numbers and no others. Its command line is that of the process it was forked from. An
unused spare ends with the parent. When all spares are used up, the next process is started the
ordinary way.
"""

from __future__ import annotations

import _posixsubprocess
import fcntl
import json
import os
import runpy
import signal
import socket
import subprocess
import sys
from collections.abc import Mapping, Sequence
from contextlib import suppress
from itertools import pairwise
from types import ModuleType
from typing import Any, Final, NoReturn

MOST_BYTES: Final = 1 << 17
_MOST_DESCRIPTORS: Final = 16
_MOST_SPARES: Final = 8
_FORK_SERVER: Final = "from multiprocessing.forkserver import main;"


def run(words: Sequence[str], env: Mapping[str, str], folder: str) -> NoReturn:
    """Run in this process what ``python -m`` would, or ``python -c``.

    Parameters
    ----------
    words
        The words after ``-m``; or ``-c`` and the code.
    env
        The whole environment.
    """
    signal.signal(signal.SIGINT, signal.default_int_handler)
    os.environ.clear()
    os.environ.update(env)
    os.chdir(folder)
    if words[0] == "-c":
        sys.argv[:] = ["-c"]
        sys.modules["__main__"] = main = ModuleType("__main__")
        exec(words[1], vars(main))
    else:
        _keep(_num_workers(words) or int(words[0] == "service.jobs"))
        module, *sys.argv[1:] = words
        runpy.run_module(module, run_name="__main__", alter_sys=True)
    sys.exit()


def has_plans(words: Sequence[str]) -> bool:
    """Return whether a program, or one that it starts, loads all kernels to plan with them."""
    # A process that only requests programs, like each test process, need not import this.
    from service.jobs.runner import Work

    return Work().preload in words or _num_workers(words) > 0


def _num_workers(words: Sequence[str]) -> int:
    """Return how many workers a program is told to start; zero if that is no number."""
    text = dict(pairwise(words)).get("--workers", "0")
    return min(int(text), _MOST_SPARES) if text.isdecimal() else 0


def _keep(number: int) -> None:
    """Fork this number of spares, and use them for the processes that this one starts."""
    spares: list[tuple[int, socket.socket]] = []
    for _ in range(number):
        ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        pid = os.fork()
        if pid == 0:
            for each in (ours, *(other for _, other in spares)):
                each.close()
            _wait(theirs)
        theirs.close()
        spares.append((pid, ours))
    if not spares:
        return
    exactly = _posixsubprocess.fork_exec

    def fork_exec(*arguments: Any) -> int:
        words = _words(arguments[0])
        if words and spares:
            pid, spare = spares.pop()
            with spare, suppress(OSError):  # it was killed, or a stream is closed
                _wake(spare, words, *arguments[3:16])
                return pid
        return exactly(*arguments)

    # ``subprocess`` keeps its own reference; ``multiprocessing`` looks the function up.
    for module, name in ((_posixsubprocess, "fork_exec"), (subprocess, "_fork_exec")):
        setattr(module, name, fork_exec)


def _words(command: Sequence[str]) -> list[str]:
    """Return the words of a command that a spare can run; none unless worker or fork server."""
    if "-m" in command:
        words = list(command[command.index("-m") + 1 :])
        return words if words[0] == "service.jobs" else []
    words = list(command[-2:])
    return words if words[0] == "-c" and words[1].startswith(_FORK_SERVER) else []


def _wake(spare: socket.socket, words: list[str], *options: Any) -> None:
    """Make a spare become a program, with these of the options of ``fork_exec``.

    They are in the order of CPython 3.11 and later.
    """
    kept, folder, env, stdin, _, _, stdout, _, stderr, _, untold, _, has_session = options
    ends = zip(range(3), (stdin, stdout, stderr), strict=True)
    descriptors = {number: number if end == -1 else end for number, end in ends}
    descriptors |= {number: number for number in kept if number != untold}
    pairs = [os.fsdecode(pair).partition("=") for pair in env or ()]
    asked = {
        "words": words,
        "env": dict(os.environ) if env is None else {name: text for name, _, text in pairs},
        "folder": folder or os.getcwd(),
        "numbers": list(descriptors),
        "has_session": bool(has_session),
    }
    socket.send_fds(spare, [json.dumps(asked).encode()], list(descriptors.values()))


def _wait(program: socket.socket) -> NoReturn:
    """Hold nothing of the program, and become what it requests, or end when it ends."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    nothing = os.open(os.devnull, os.O_RDWR)
    for number in range(3):
        os.dup2(nothing, number)
    os.close(nothing)
    data, descriptors, _, _ = socket.recv_fds(program, MOST_BYTES, _MOST_DESCRIPTORS)
    if not data:
        os._exit(0)
    program.close()
    asked = json.loads(data)
    # Place copies above all wanted numbers, so that none is overwritten.
    above = max(asked["numbers"]) + 1
    copies = [fcntl.fcntl(each, fcntl.F_DUPFD, above) for each in descriptors]
    for each in descriptors:
        os.close(each)
    for each, number in zip(copies, asked["numbers"], strict=True):
        os.dup2(each, number)
        os.close(each)
    if asked["has_session"]:
        os.setsid()
    run(asked["words"], asked["env"], asked["folder"])
