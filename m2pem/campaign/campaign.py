"""A whole campaign: runs are rehearsed, kept, and tested as they come."""

from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path

from m2pem.campaign.folder import CampaignFolder
from m2pem.campaign.pool import Chunk, chunks_of, rehearse_on_cluster, rehearse_on_processes
from m2pem.campaign.runs import Order, Row, rehearse_runs
from m2pem.campaign.statistics import SequentialTest, is_good
from m2pem.campaign.variations import read_variations
from m2pem.errors import OperatorError

CHUNK = 50
"""So many runs are handed to a process at once, and written to one file."""


@dataclass(frozen=True, slots=True)
class CampaignResult:
    """The rows of a campaign by their runs. `wanted`: how many runs it was to have. `decision`: of
    the sequential test, "p0" or "p1", and after how many runs; "": none, or not decided."""

    order: Order
    rows: tuple[Row, ...]
    wanted: int
    decision: str = ""
    decided_after: int = 0
    interrupted: bool = False


def run_campaign(
    order: Order,
    runs: int,
    *,
    workers: int = 1,
    cluster: str = "",
    folder: Path | None = None,
    resume: bool = False,
    test: SequentialTest | None = None,
    chunk: int = CHUNK,
    on_progress: Callable[[int], None] = lambda _: None,
) -> CampaignResult:
    """Rehearse the runs 0 to `runs` - 1, each of which depends on the order and its number alone.

    `workers`: processes; 1 is this one. `cluster`: the URL of a Dask scheduler, in place of them.
    `folder`: what is done is written there chunk by chunk. An interrupt ends the campaign, and what
    was done until then is its result. `test`: ends it when it is decided, in the order of the runs.

    Raises:
        OperatorError: the folder or the cluster cannot be used, or the test.
    """
    if test is not None and read_variations(order.variations).weighted:
        raise OperatorError("a sequential test counts runs: it does not go with `sampled`")
    store = None if folder is None else CampaignFolder(folder, order, resume=resume)
    rows = {row["run"]: row for row in (store.rows() if store else ()) if row["run"] < runs}
    chunks = chunks_of([run for run in range(runs) if run not in rows], chunk)
    interrupted = False
    if chunks and not _decided(test, rows)[0]:
        try:
            with closing(_rehearsed(order, chunks, workers, cluster)) as done:
                for new in done:
                    rows.update({row["run"]: row for row in new})
                    if store is not None:
                        store.add(new)
                    on_progress(len(rows))
                    if _decided(test, rows)[0]:
                        break
        except KeyboardInterrupt:
            interrupted = True
    decision, after = _decided(test, rows)
    ordered = tuple(rows[run] for run in sorted(rows))
    return CampaignResult(order, ordered, runs, decision, after, interrupted)


def _decided(test: SequentialTest | None, rows: dict[int, Row]) -> tuple[str, int]:
    """Return the decision by the first runs that are all there: so it is the same whatever comes
    first."""
    if test is None:
        return "", 0
    return test.decide(_failures(rows))


def _failures(rows: dict[int, Row]) -> Iterator[bool]:
    run = 0
    while run in rows:
        if not rows[run]["error"]:
            yield not is_good(rows[run])
        run += 1


def _rehearsed(
    order: Order, chunks: Sequence[Chunk], workers: int, cluster: str
) -> Generator[list[Row], None, None]:
    if cluster:
        yield from rehearse_on_cluster(order, chunks, cluster)
    elif workers > 1:
        yield from rehearse_on_processes(order, chunks, workers)
    else:
        for chunk in chunks:
            yield rehearse_runs(order, chunk)
