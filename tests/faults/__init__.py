"""Faults of storage and steps of clocks, for processes of m2pem that tests start.

A library that is loaded before all others makes calls of the C library fail (`preload.c`): so any
user can have any fault, on any file system, at any moment. It needs a C compiler.
"""

import errno
import shutil
import subprocess
import tempfile
from functools import cache
from pathlib import Path

from tests.preloaded import Preloaded

_BYTES = 4096
_SOURCE = Path(__file__).with_name("preload.c")


class Faults:
    """The faults of the processes whose environment has `variables`; none at first."""

    def __init__(self, folder: Path) -> None:
        self._file = folder / "faults"
        self._file.write_bytes(bytes(_BYTES))
        self.variables = {"M2PEM_FAULTS": str(self._file)}

    def set(self, *rules: str) -> None:
        """Have these faults from now on, and no others; see `preload.c`."""
        text = "".join(f"{rule}\n" for rule in rules).encode()
        with self._file.open("r+b") as file:
            file.write(text.ljust(_BYTES, b"\0"))

    def fail(self, error: int, *calls: str, name: str) -> None:
        """Have calls (write, sync, read, open) on files that have `name` in their path fail."""
        assert error in errno.errorcode
        self.set(*(f"{call} {error} {name}" for call in calls))

    def hang(self, *calls: str, name: str) -> None:
        """Have calls on files that have `name` in their path hang until there is another fault."""
        self.set(*(f"{call} -1 {name}" for call in calls))

    def clear(self) -> None:
        """Have no faults any more."""
        self.set()


@cache
def library() -> Path:
    """Return the library, which any user may load."""
    compiler = next(filter(None, map(shutil.which, ("cc", "tcc", "gcc", "clang"))), None)
    assert compiler is not None, "these tests need a C compiler: install tcc"
    made = Path(tempfile.mkdtemp(prefix="m2pem-faults-")) / "faults.so"
    made.parent.chmod(0o755)
    subprocess.run([compiler, "-shared", "-fPIC", "-w", "-o", made, _SOURCE, "-ldl"], check=True)
    return made


@cache
def with_faults() -> Preloaded:
    """The process from which those are forked that may have faults."""
    return Preloaded({"LD_PRELOAD": str(library())})
