"""Lines as they are typed."""

import asyncio
import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from m2pem.api.foreground import Lines
from tests.command_line import REPOSITORY


class Pipe:
    """`type` into it; close each end once, be it here or in the end."""

    def __init__(self) -> None:
        self.reading, self._writing = os.pipe()
        self._open = {self.reading, self._writing}

    def type(self, text: bytes) -> None:
        os.write(self._writing, text)

    def hang_up(self) -> None:
        self._close(self._writing)

    def break_off(self) -> None:
        self._close(self.reading)

    def close(self) -> None:
        for end in tuple(self._open):
            self._close(end)

    def _close(self, end: int) -> None:
        self._open.remove(end)
        os.close(end)


@pytest.fixture
def pipe() -> Iterator[Pipe]:
    made = Pipe()
    yield made
    made.close()


async def test_lines_come_without_their_ends(pipe: Pipe) -> None:
    pipe.type(b"one\ntwo\r\n\nthr")
    pipe.type("ée\nlast".encode())
    pipe.hang_up()
    assert [line async for line in Lines(pipe.reading)] == ["one", "two", "", "thrée", "last"]


async def test_a_line_comes_when_it_is_typed(pipe: Pipe) -> None:
    lines = aiter(Lines(pipe.reading))
    waiting = asyncio.ensure_future(anext(lines))
    await asyncio.sleep(0)
    assert not waiting.done()
    pipe.type(b"now\n")
    assert await waiting == "now"
    pipe.hang_up()
    assert [line async for line in lines] == []  # its thread is done with the descriptor


async def test_bytes_that_are_no_utf_8_are_replaced(pipe: Pipe) -> None:
    pipe.type(b"\xff\xc3")
    pipe.hang_up()
    assert [line async for line in Lines(pipe.reading)] == ["\ufffd"]


async def test_a_file_is_read(tmp_path: Path) -> None:
    path = tmp_path / "lines"
    path.write_text("a\nb\n")
    with path.open("rb") as file:
        assert [line async for line in Lines(file.fileno())] == ["a", "b"]


async def test_an_input_that_is_closed_is_at_its_end(pipe: Pipe) -> None:
    pipe.break_off()
    assert [line async for line in Lines(pipe.reading)] == []


async def test_a_descriptor_that_does_not_block_is_waited_for(pipe: Pipe) -> None:
    os.set_blocking(pipe.reading, False)
    lines = aiter(Lines(pipe.reading))
    waiting = asyncio.ensure_future(anext(lines))
    await asyncio.sleep(0)
    pipe.type(b"late\n")
    assert await waiting == "late"
    pipe.hang_up()
    assert [line async for line in lines] == []


def test_a_program_that_reads_can_end(pipe: Pipe) -> None:
    """Its input stays open, and nothing is typed: it ends all the same, and quietly."""
    code = """
import asyncio
from m2pem.api.foreground import Lines

async def main():
    waiting = asyncio.create_task(anext(aiter(Lines())))
    await asyncio.sleep(0)
    waiting.cancel()

asyncio.run(main())
"""
    done = subprocess.run(
        [sys.executable, "-c", code],
        cwd=REPOSITORY,
        stdin=pipe.reading,
        capture_output=True,
        text=True,
        check=False,
    )
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
