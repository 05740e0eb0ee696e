"""The plain operator control unit keeps the contract of every such unit."""

import io
import os
from collections.abc import Iterator

import pytest

from m2pem.api.control import MissionControl
from m2pem.api.foreground import Lines
from m2pem.api.ocu import Ocu
from m2pem.api.runs import OpenPrompt
from m2pem.cli.plain import PlainOcu
from m2pem.testing.contracts.ocu import MakeOcu, OcuContract, Operate, Operator


class Typist:
    """Types lines into a pipe, and reads what was printed."""

    def __init__(self, printed: io.StringIO, keys: int) -> None:
        self._printed = printed
        self._keys = keys

    def screen(self) -> str:
        return self._printed.getvalue()

    async def answer(self, prompt: OpenPrompt, decision: str) -> None:
        self._type(f"{prompt.run} {prompt.prompt} {decision}")

    async def stop(self, run: str) -> None:
        self._type(f"stop {run}")

    def _type(self, line: str) -> None:
        os.write(self._keys, f"{line}\n".encode())


class TestPlainOcu(OcuContract):
    @pytest.fixture
    def seats(self, monkeypatch: pytest.MonkeyPatch) -> Iterator[dict[int, Typist]]:
        """The typist of each unit by its id; `Lines` reads the pipe of the unit made last."""
        self.read_ends: list[int] = []
        self.write_ends: list[int] = []
        monkeypatch.setattr("m2pem.cli.plain.Lines", lambda: Lines(self.read_ends.pop(0)))
        yield {}
        for end in self.write_ends:
            os.close(end)

    @pytest.fixture
    def make_ocu(self, seats: dict[int, Typist], monkeypatch: pytest.MonkeyPatch) -> MakeOcu:
        def make(control: MissionControl) -> Ocu:
            printed = io.StringIO()
            monkeypatch.setattr("sys.stdout", printed)
            read_end, write_end = os.pipe()
            self.read_ends.append(read_end)
            self.write_ends.append(write_end)
            ocu = PlainOcu(control)
            seats[id(ocu)] = Typist(printed, write_end)
            return ocu

        return make

    @pytest.fixture
    def operate(self, seats: dict[int, Typist]) -> Operate:
        def sit_at(ocu: Ocu) -> Operator:
            return seats[id(ocu)]

        return sit_at
