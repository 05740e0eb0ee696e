"""Who rehearses the runs: a pool of processes on this host, or a Dask cluster.

Both yield the rows of chunks as they are done, in any order. A chunk whose process is killed is
rehearsed again; a run that kills its process every time becomes a row with an error.
"""

import signal
from collections import deque
from collections.abc import Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from multiprocessing import get_context

from m2pem.campaign.runs import Order, Row, rehearse_runs
from m2pem.errors import OperatorError

Chunk = tuple[int, ...]

ATTEMPTS = 3
"""A run that was under way as often when its process died is given up."""

AHEAD = 2
"""Chunks of each process that are handed out at once."""


def chunks_of(runs: Sequence[int], size: int) -> list[Chunk]:
    """Return the runs in chunks."""
    return [tuple(runs[place : place + size]) for place in range(0, len(runs), size)]


def rehearse_on_processes(
    order: Order, chunks: Sequence[Chunk], workers: int
) -> Iterator[list[Row]]:
    """Yield the rows of each chunk, rehearsed by so many processes of this host."""
    waiting = deque(chunks)
    deaths: dict[Chunk, int] = {}
    while waiting:
        # A process of its own begins with nothing of this one: no thread, no event loop.
        pool = ProcessPoolExecutor(
            workers, mp_context=get_context("spawn"), initializer=_begin_process
        )
        under_way: dict[Future[list[Row]], Chunk] = {}
        try:
            while waiting or under_way:
                ahead = AHEAD * workers
                # A chunk that saw a process die is rehearsed alone, to know whose fault it is.
                while waiting and len(under_way) < (1 if deaths.get(waiting[0]) else ahead):
                    if any(deaths.get(chunk) for chunk in under_way.values()):
                        break
                    under_way[pool.submit(rehearse_runs, order, waiting[0])] = waiting[0]
                    waiting.popleft()
                done, _ = wait(under_way, return_when=FIRST_COMPLETED)
                for future in done:
                    rows = future.result()
                    del under_way[future]
                    yield rows
        except BrokenProcessPool:
            for future, chunk in under_way.items():
                if future.done() and future.exception() is None:
                    yield future.result()
                    continue
                deaths[chunk] = deaths.get(chunk, 0) + 1
                if deaths[chunk] < ATTEMPTS:
                    waiting.append(chunk)
                elif len(chunk) > 1:
                    waiting.extend((run,) for run in chunk)
                else:
                    yield [{"run": chunk[0], "error": "its process was killed, every time"}]
        finally:
            pool.shutdown(cancel_futures=True)


def _begin_process() -> None:
    """Leave an interrupt (Ctrl-C) to the process that owns the pool."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)


def rehearse_on_cluster(order: Order, chunks: Sequence[Chunk], url: str) -> Iterator[list[Row]]:
    """Yield the rows of each chunk, rehearsed by the workers of a Dask cluster.

    `url`: of its scheduler, such as tcp://10.0.0.1:8786. Its workers need the same m2pem.

    Raises:
        OperatorError: Dask is not installed, or the scheduler does not answer.
    """
    try:
        from distributed import Client, as_completed  # noqa: PLC0415  # an extra
    except ModuleNotFoundError as error:
        raise OperatorError("--cluster needs Dask: pip install 'm2pem[dask]'") from error
    try:
        client = Client(url, timeout=10)
    except (OSError, ValueError) as error:
        raise OperatorError(f"the scheduler {url} does not answer: {error}") from error
    with client:
        [sent] = client.scatter([order], broadcast=True)
        futures = {
            client.submit(rehearse_runs, sent, chunk, pure=False, retries=ATTEMPTS): chunk
            for chunk in chunks
        }
        for future in as_completed(list(futures)):
            failure = future.exception()
            if failure is None:
                yield future.result()
            else:
                yield [{"run": run, "error": str(failure)} for run in futures[future]]
