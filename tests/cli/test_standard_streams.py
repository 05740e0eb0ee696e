import io
import os
import threading

from m2pem.cli.standard_streams import LineWriter, writer_for


class Stuck(io.StringIO):
    """Nobody reads until `let_go`."""

    def __init__(self) -> None:
        super().__init__()
        self.reading = threading.Event()
        self.writes = 0

    def write(self, text: str) -> int:
        self.writes += 1
        self.reading.wait()
        return super().write(text)


def test_lines_come_out_in_order() -> None:
    stream = io.StringIO()
    writer = LineWriter(stream)
    for number in range(1000):
        writer.put(str(number))
    writer.drain()
    assert stream.getvalue().split() == [str(number) for number in range(1000)]


def test_putting_never_waits_for_the_reader() -> None:
    stream = Stuck()
    writer = LineWriter(stream)
    for number in range(1000):
        writer.put(str(number))
    stream.reading.set()
    writer.drain()
    assert len(stream.getvalue().splitlines()) == 1000
    assert stream.writes < 1000


def test_users_of_one_stream_share_a_writer() -> None:
    one, other = io.StringIO(), io.StringIO()
    assert writer_for(one) is writer_for(one)
    assert writer_for(one) is not writer_for(other)


def test_a_reader_who_went_away_is_told_of_once() -> None:
    reading, writing = os.pipe()
    os.close(reading)
    told: list[bool] = []
    with os.fdopen(writing, "w") as stream:
        writer = LineWriter(stream)
        writer.when_broken(lambda: told.append(True))
        for _ in range(3):
            writer.put("x")
            writer.drain()
        assert writer.broken
        assert told == [True]
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, writing)  # for what the stream still holds when it is closed
        os.close(nowhere)


def test_a_full_writer_says_so() -> None:
    stream = Stuck()
    writer = LineWriter(stream)
    assert not writer.full
    for _ in range(200_001):
        writer.put("")
    assert writer.full
    stream.reading.set()
    writer.drain()
    assert not writer.full
