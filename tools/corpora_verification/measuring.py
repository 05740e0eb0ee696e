"""Judges each file in a forked process, and measures what it took: a crash costs one file."""

import gc
import os
import pickle
import resource
import select
import signal
import traceback
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import NoReturn

from tools.corpora_verification.judging import Judgement, Terms, judge

_GRACE = 15.0
"""How many times its seconds a file may take before it counts as a hang."""
_SPARE_MB = 1_000.0
"""Address space beyond the memory asked for: it is reserved, not used."""
_PAGE = resource.getpagesize()
_WORD = 8
"""Bytes in which a process says first how much memory it began with."""


@dataclass(frozen=True, slots=True)
class Measured:
    """`judgement` None: `crash` says why. `peak_mb`: of memory, beyond what it began with."""

    path: Path
    judgement: Judgement | None
    crash: str
    peak_mb: float


def measure_all(paths: Iterable[Path], terms: Terms) -> Iterator[Measured]:
    """Each file, in order, one at a time."""
    for path in paths:
        yield _measure(path, terms)


def _measure(path: Path, terms: Terms) -> Measured:
    reading, writing = os.pipe()
    child = os.fork()
    if not child:
        os.close(reading)
        _serve(path, terms, writing)
    os.close(writing)
    said = _read(reading, child, terms.seconds * _GRACE)
    os.close(reading)
    _, status, used = os.wait4(child, 0)
    began, said = said[:_WORD], said[_WORD:]
    peak_mb = used.ru_maxrss / 1024 - int.from_bytes(began, "little") / (1 << 20)
    if not said:
        code = os.waitstatus_to_exitcode(status)
        return Measured(path, None, f"the process ended with {code}", peak_mb)
    found = pickle.loads(said)
    if isinstance(found, str):
        return Measured(path, None, found, peak_mb)
    return Measured(path, found, "", peak_mb)


def _serve(path: Path, terms: Terms, writing: int) -> NoReturn:
    gc.freeze()  # a collection would copy all that the process was forked with
    size, resident = _memory()
    os.write(writing, resident.to_bytes(_WORD, "little"))
    address_space = size + int((terms.memory_mb + _SPARE_MB) * 1e6)
    resource.setrlimit(resource.RLIMIT_AS, (address_space, address_space))
    found: Judgement | str
    try:
        found = judge(path, terms)
    except Exception:
        found = traceback.format_exc()
    with os.fdopen(writing, "wb") as stream:
        pickle.dump(found, stream)
    os._exit(0)


def _memory() -> tuple[int, int]:
    """Bytes of address space, and of it in memory, of this process now."""
    size, resident = Path("/proc/self/statm").read_text(encoding="ascii").split()[:2]
    return int(size) * _PAGE, int(resident) * _PAGE


def _read(reading: int, child: int, hang_s: float) -> bytes:
    """What the process says; if it had to be stopped, that."""
    said = b""
    while True:
        ready, _, _ = select.select([reading], [], [], hang_s)
        if not ready:
            os.kill(child, signal.SIGKILL)
            return said[:_WORD].ljust(_WORD, b"\0") + pickle.dumps(
                f"it hangs: nothing is said for {hang_s:g} s"
            )
        part = os.read(reading, 1 << 16)
        if not part:
            return said
        said += part
