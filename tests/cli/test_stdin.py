import asyncio
import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from m2pem.cli.stdin import Lines
from tests.command_line import REPOSITORY


@pytest.fixture
def pipe() -> Iterator[tuple[int, int]]:
    ends = os.pipe()
    yield ends
    for end in ends:
        try:
            os.close(end)
        except OSError:
            pass


async def test_lines_come_without_their_ends(pipe: tuple[int, int]) -> None:
    reading, writing = pipe
    os.write(writing, b"one\ntwo\r\n\nthr")
    os.write(writing, "ée\nlast".encode())
    os.close(writing)
    assert [line async for line in Lines(reading)] == ["one", "two", "", "thrée", "last"]


async def test_a_line_comes_when_it_is_typed(pipe: tuple[int, int]) -> None:
    reading, writing = pipe
    lines = aiter(Lines(reading))
    waiting = asyncio.ensure_future(anext(lines))
    await asyncio.sleep(0)
    assert not waiting.done()
    os.write(writing, b"now\n")
    assert await waiting == "now"


async def test_bytes_that_are_no_utf_8_are_replaced(pipe: tuple[int, int]) -> None:
    reading, writing = pipe
    os.write(writing, b"\xff\xc3")
    os.close(writing)
    assert [line async for line in Lines(reading)] == ["\ufffd"]


async def test_a_file_is_read(tmp_path: Path) -> None:
    path = tmp_path / "lines"
    path.write_text("a\nb\n")
    with path.open("rb") as file:
        assert [line async for line in Lines(file.fileno())] == ["a", "b"]


async def test_an_input_that_is_closed_is_at_its_end(pipe: tuple[int, int]) -> None:
    reading, _ = pipe
    os.close(reading)
    assert [line async for line in Lines(reading)] == []


async def test_a_descriptor_that_does_not_block_is_waited_for(pipe: tuple[int, int]) -> None:
    reading, writing = pipe
    os.set_blocking(reading, False)
    lines = aiter(Lines(reading))
    waiting = asyncio.ensure_future(anext(lines))
    await asyncio.sleep(0)
    os.write(writing, b"late\n")
    assert await waiting == "late"


def test_a_program_that_reads_can_end(pipe: tuple[int, int]) -> None:
    """Its input stays open, and nobody types: it ends all the same, and quietly."""
    reading, _ = pipe
    code = """
import asyncio
from m2pem.cli.stdin import Lines

async def main():
    waiting = asyncio.create_task(anext(aiter(Lines())))
    await asyncio.sleep(0)
    waiting.cancel()

asyncio.run(main())
"""
    done = subprocess.run(
        [sys.executable, "-c", code],
        cwd=REPOSITORY,
        stdin=reading,
        capture_output=True,
        text=True,
        check=False,
    )
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
