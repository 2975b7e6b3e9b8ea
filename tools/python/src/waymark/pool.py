# SPDX-License-Identifier: Apache-2.0
"""Jobs in as many processes as there are processors. Their memory is prepared once; a job that takes too long ends its process alone."""

import contextlib
import os
import pickle
import select
import signal
from collections.abc import Callable
from typing import Any


def _work(function: Callable[[Any], Any], jobs: int, results: int) -> None:
    """A worker: until the pipe of jobs ends."""
    signal.signal(signal.SIGPROF, signal.SIG_DFL)
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    with os.fdopen(jobs, "rb") as given, os.fdopen(results, "wb") as taken:
        while True:
            try:
                job, most_s = pickle.load(given)  # written by this program itself
            except EOFError:
                return
            signal.setitimer(signal.ITIMER_PROF, most_s)
            pickle.dump(function(job), taken)
            taken.flush()


class _Worker:
    def __init__(self, function: Callable[[Any], Any]) -> None:
        given, self._jobs = os.pipe()
        results, taken = os.pipe()
        self.process = os.fork()
        if self.process == 0:
            try:
                os.close(self._jobs)
                os.close(results)
                _work(function, given, taken)
            finally:
                os._exit(0)
        os.close(given)
        os.close(taken)
        self.results = os.fdopen(results, "rb")

    def give(self, job: Any, most_s: float) -> None:
        """Begins a job."""
        data = pickle.dumps((job, most_s))
        while data:
            data = data[os.write(self._jobs, data):]

    def take(self) -> tuple[bool, Any]:
        """Its result; False: the worker has ended over it."""
        try:
            return True, pickle.load(self.results)  # written by this program's own child
        except (EOFError, pickle.UnpicklingError):
            return False, None

    def end(self) -> None:
        """Ends the worker, whatever it does."""
        with contextlib.suppress(ProcessLookupError):
            os.kill(self.process, signal.SIGKILL)
        os.close(self._jobs)
        self.results.close()
        os.waitpid(self.process, 0)


class Pool:
    """Processes that call `function` with a job each."""

    def __init__(self, function: Callable[[Any], Any]) -> None:
        self.at_once = len(os.sched_getaffinity(0))
        self._function = function
        self._idle: list[_Worker] = []

    def run(self, count: int, prepare: Callable[[int], Any], ended: Callable[[int, Any, bool], None], most_s: float) -> None:
        """`prepare` gives the job of each number, None: there is none. `ended` gets number and result, False where the job took more than
        `most_s` of processor time."""
        waiting = list(range(count))[::-1]
        self._idle += [_Worker(self._function) for _ in range(min(self.at_once, count) - len(self._idle))]
        running: dict[int, tuple[_Worker, int]] = {}
        while waiting or running:
            while waiting and self._idle:
                number = waiting.pop()
                job = prepare(number)
                if job is None:
                    continue
                worker = self._idle.pop()
                worker.give(job, most_s)
                running[worker.results.fileno()] = worker, number
            for pipe in select.select(list(running), [], [])[0] if running else []:
                worker, number = running.pop(pipe)
                is_there, result = worker.take()
                if not is_there:
                    worker.end()
                    worker = _Worker(self._function)
                self._idle.append(worker)
                ended(number, result, is_there)

    def end(self) -> None:
        """Ends the processes."""
        for worker in self._idle:
            worker.end()
        self._idle.clear()
