"""Which executive may still command a run: the epoch of each command, compared at its receiver."""

import json
import logging
from pathlib import Path

from m2pem.api.arbiter import BehaviorId
from m2pem.api.remember import remember
from m2pem.errors import StaleCommandError
from m2pem.whole_file import write_whole

REMEMBERED = 10_000

log = logging.getLogger("m2pem.epochs")


def run_of(behavior: BehaviorId) -> str:
    """Return the run of a behavior: "r1" of "r1.b3", and of "r1.b3.evsg1", a team's part of it."""
    return behavior.partition(".")[0]


class EpochFence:
    """The highest epoch seen for each run; the runs seen longest ago are forgotten.

    `file`: where the epochs are kept across restarts, as JSON, readable by its owner alone; None:
    they are forgotten with the process. A file that cannot be read or written is logged, and the
    fence goes on in memory.
    """

    def __init__(self, file: Path | None = None) -> None:
        self._file = file
        self._highest: dict[str, int] = {} if file is None else _read(file)

    def newest(self, behavior: BehaviorId) -> int:
        """Return the highest epoch seen for the run of a behavior, or for a run; 0: none was."""
        return self.newest_of_run(run_of(behavior))

    def newest_of_run(self, run: str) -> int:
        """The same for a run, whose name may be any text."""
        return self._highest.get(run, 0)

    def admit(self, behavior: BehaviorId, epoch: int) -> bool:
        """Whether a command of this epoch is good. A higher one than before is remembered.

        `behavior`: of the command, or the run itself.
        """
        return self.admit_run(run_of(behavior), epoch)

    def admit_run(self, run: str, epoch: int) -> bool:
        """The same for a run, whose name may be any text."""
        before = self._highest.get(run)
        highest = epoch if before is None else max(epoch, before)
        remember(self._highest, run, highest, REMEMBERED)
        if self._file is not None and highest != before:
            _write(self._file, self._highest)
        return epoch >= highest

    def require(self, what: str, behavior: BehaviorId, epoch: int) -> None:
        """Check that a command is good; `what` names it: "start".

        Raises:
            StaleCommandError: a higher epoch was seen, which the error names.
        """
        if not self.admit(behavior, epoch):
            raise StaleCommandError(
                f"{what} of {behavior}", run_of(behavior), epoch, self.newest(behavior)
            )


def _read(file: Path) -> dict[str, int]:
    try:
        content = json.loads(file.read_bytes())
        return {str(run): int(epoch) for run, epoch in content.items()}
    except FileNotFoundError:
        return {}
    except (OSError, ValueError, TypeError, AttributeError) as error:
        log.warning("%s: the epochs of earlier commands cannot be read: %s", file, error)
        return {}


def _write(file: Path, epochs: dict[str, int]) -> None:
    try:
        write_whole(file, json.dumps(epochs).encode())
    except OSError as error:
        log.warning("%s: the epoch of a command cannot be kept: %s", file, error.strerror)
