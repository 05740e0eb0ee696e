"""Jobs that browsers start and poll: verifications and rehearsals."""

import asyncio
import logging
import secrets
from collections.abc import Awaitable, Callable
from contextlib import suppress
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Generic, TypeVar

from m2pem.api import Finding
from m2pem.errors import FindingsError, M2pemError
from m2pem_plugin_web.missions.names import PathNames
from m2pem_plugin_web.problems import ProblemError

T = TypeVar("T")

AT_ONCE = 2
"""Jobs of a kind that run at once, as each uses a processor; others wait."""
MOST_WAITING = 20
KEPT = 20
"""Results of a kind that are kept; the oldest are dropped."""

log = logging.getLogger("m2pem.ocu.web")


class JobState(StrEnum):
    """The state of a job; one that waits for others counts as running."""

    RUNNING = "running"
    DONE = "done"
    FAILED = "failed"
    CANCELLED = "cancelled"


@dataclass(slots=True, eq=False)
class Job(Generic[T]):
    """A job. `problem`: why it failed, with all `findings` if a file cannot be used."""

    id: str
    by: str
    state: JobState = JobState.RUNNING
    result: T | None = None
    problem: str = ""
    findings: tuple[Finding, ...] = ()
    task: "asyncio.Task[None] | None" = field(default=None, repr=False)


class Jobs(Generic[T]):
    """Jobs of one kind. `kind`: the name in messages; `called`: replaces paths in them."""

    def __init__(self, kind: str, called: PathNames) -> None:
        self._kind = kind
        self._called = called
        self._jobs: dict[str, Job[T]] = {}
        self._free = asyncio.Semaphore(AT_ONCE)

    def begin(self, by: str, work: Callable[[str], Awaitable[T]]) -> Job[T]:
        """Begin a job, now or when others have ended. `work` is called with its id.

        Raises:
            ProblemError: too many jobs wait.
        """
        running = [each for each in self._jobs.values() if each.state is JobState.RUNNING]
        if len(running) >= AT_ONCE + MOST_WAITING:
            raise ProblemError(429, f"too many {self._kind}s wait: try again later")
        job: Job[T] = Job(secrets.token_hex(8), by)
        self._jobs[job.id] = job
        job.task = asyncio.get_running_loop().create_task(
            self._do(job, work), name=f"web: {self._kind} {job.id}"
        )
        self._forget()
        return job

    def get(self, identifier: str) -> Job[T]:
        """Return a job by its id.

        Raises:
            ProblemError: 404, it does not exist.
        """
        job = self._jobs.get(identifier)
        if job is None:
            raise ProblemError(404, f"there is no {self._kind} {identifier}")
        return job

    async def cancel(self, identifier: str) -> None:
        """Cancel a job; one that has ended stays as it is.

        Raises:
            ProblemError: 404, it does not exist.
        """
        job = self.get(identifier)
        if job.task is not None and not job.task.done():
            job.task.cancel()
            with suppress(asyncio.CancelledError):
                await asyncio.wait([job.task])

    async def close(self) -> None:
        """Cancel all jobs."""
        tasks = [each.task for each in self._jobs.values() if each.task is not None]
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)

    async def _do(self, job: Job[T], work: Callable[[str], Awaitable[T]]) -> None:
        try:
            async with self._free:
                job.result = await work(job.id)
            job.state = JobState.DONE
        except asyncio.CancelledError:
            job.state = JobState.CANCELLED
            raise
        except FindingsError as error:
            job.state, job.problem = JobState.FAILED, self._called.text(error.what)
            job.findings = self._called.findings(error.findings)
        except M2pemError as error:
            job.state, job.problem = JobState.FAILED, self._called.text(str(error))
        except Exception:  # a failed job must not end the server
            log.exception("%s %s", self._kind, job.id)
            job.state, job.problem = JobState.FAILED, "the server failed; its log has the error"

    def _forget(self) -> None:
        over = [each.id for each in self._jobs.values() if each.state is not JobState.RUNNING]
        for identifier in over[:-KEPT]:
            del self._jobs[identifier]
