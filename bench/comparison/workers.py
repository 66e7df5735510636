"""Attempts in a process of their own for each peer: one that crashes, hangs or takes all memory ends alone."""

from __future__ import annotations

import importlib
import multiprocessing
import os
import resource
from collections.abc import Mapping
from functools import lru_cache
from multiprocessing.connection import Connection

from peers.interface import Budget, Peer

from .attempts import Attempt, attempt
from .problems import Subject

#: Address space of a worker: a method that needs more fails, instead of the machine.
_MEMORY = 8 << 30
#: Budget of the run before the first attempt of a case is timed: first calls load parts of a library.
_WARMING = Budget(60, 0.3)
#: Seconds beyond its budget after which an attempt is ended: judgement and polish; and a solve, which has no budget.
_GRACE = 20.0
#: The same for the first attempt of a case, with the warming run, in which generated C is compiled.
_FIRST_GRACE = 60.0
#: Exit status of a process in which a package loads.
_LOADED = 42


class LostWorkerError(Exception):
    """The process of a peer died or did not answer in time."""


class Worker:
    """A process that makes the attempts of one peer; it begins at the first attempt, and anew after a loss."""

    def __init__(self, peer: Peer, subjects: Mapping[str, Subject]) -> None:
        self._peer, self._subjects = peer, subjects
        self._process: multiprocessing.process.BaseProcess | None = None
        self._pipe: Connection | None = None
        self._warmed: set[str] = set()

    def attempt(self, case: str, seed: int, budget: Budget) -> Attempt:
        """Return an attempt.

        Raises:
            LostWorkerError: the process died, or took too long.
        """
        if self._process is None or self._pipe is None:
            self._begin()
        pipe, process = self._pipe, self._process
        if pipe is None or process is None:
            raise LostWorkerError("no process")
        try:
            seconds = budget.seconds + (_GRACE if case in self._warmed else _FIRST_GRACE)
            self._warmed.add(case)
            pipe.send((case, seed, budget))
            if not pipe.poll(seconds):
                self.end()
                raise LostWorkerError(f"ended after {seconds:.0f} s without an answer")
            return pipe.recv()
        except (EOFError, OSError) as fault:
            process.join(1.0)
            code = process.exitcode
            self.end()
            raise LostWorkerError(f"the process died with exit status {code}") from fault

    def end(self) -> None:
        """End the process."""
        if self._process is not None:
            self._process.kill()
            self._process.join()
        self._process = self._pipe = None
        self._warmed.clear()

    def _begin(self) -> None:
        """Begin the process as a copy of this one: programs are built already."""
        context = multiprocessing.get_context("fork")
        self._pipe, theirs = context.Pipe()
        self._process = context.Process(target=_serve, args=(self._peer, self._subjects, theirs), daemon=True)
        self._process.start()
        theirs.close()


@lru_cache
def loads(package: str) -> bool:
    """Load a package before the workers begin, so that each need not; first in a process that may die of it.

    Returns:
        Whether the package is there and loads.
    """
    name = f"{package}.optimize" if package == "scipy" else package
    process = multiprocessing.get_context("fork").Process(target=_load, args=(name,))
    process.start()
    process.join()
    if process.exitcode == _LOADED:
        importlib.import_module(name)
    return process.exitcode == _LOADED


def _load(name: str) -> None:
    """Import a module, and end the process with the status that says so."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), 2)
    importlib.import_module(name)
    os._exit(_LOADED)


def _serve(peer: Peer, subjects: Mapping[str, Subject], pipe: Connection) -> None:
    """Make attempts as they are asked for."""
    resource.setrlimit(resource.RLIMIT_AS, (_MEMORY, _MEMORY))
    # What a library prints belongs to no table.
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, 1)
    os.dup2(nowhere, 2)
    warmed: set[str] = set()
    while True:
        try:
            case, seed, budget = pipe.recv()
        except EOFError:
            return
        if case not in warmed:
            warmed.add(case)
            attempt(peer, subjects[case], 10_000, _WARMING)
        pipe.send(attempt(peer, subjects[case], seed, budget))
