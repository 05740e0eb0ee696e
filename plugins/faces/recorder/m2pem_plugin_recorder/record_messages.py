"""The messages of a run's records: each record, and what some say of questions and pictures."""

from collections.abc import Iterable, Iterator

import msgspec

from m2pem.api import US_PER_S, RunId, StampedRecord
from m2pem.api import records as r
from m2pem_plugin_recorder.channels import (
    ChannelMessage,
    PicturesMessage,
    PromptMessage,
    pictures_channel,
    prompts_channel,
    records_channel,
)

_encode = msgspec.json.Encoder().encode

_PICTURES = "picture.files"

_NOTED = frozenset((r.RunStarted, r.RunPaused, r.RunResumed, r.PromptOpened))
_SHOWN = frozenset((r.PromptOpened, r.PromptAnswered, r.PromptWithdrawn, r.DataWritten))
"""Records with a second message. Most records are in neither set: they must be fast."""


class _Head(msgspec.Struct):
    """What a line says before the record."""

    run: str
    seq: int
    t: float


class RecordEncoder:
    """Encodes the records of one run, which come in order and without a gap, from the first on.

    From `RunStarted`, `RunPaused` and `RunResumed` it knows at what time a mission time was.
    """

    def __init__(self, run: RunId) -> None:
        self.run = run
        self.seq = 0
        """The number of the last record."""
        self.started_us = 0
        self._paused_us = 0
        self._paused_at_us = 0
        self._prompts: dict[str, r.PromptOpened] = {}

    def take(self, stamped: StampedRecord) -> int:
        """Take note of a record; return its time in microseconds since the Unix epoch."""
        record = stamped.record
        self.seq = stamped.seq
        if type(record) in _NOTED:
            self._note(record)
        # Mission time stands during a pause, which begins at its own time.
        at_us = self.started_us + self._paused_us + round(stamped.t_s * US_PER_S)
        return max(at_us, self._paused_at_us)

    def messages(self, stamped: StampedRecord) -> Iterable[ChannelMessage]:
        """Take note of a record, and return its messages."""
        at_us = self.take(stamped)
        line = ChannelMessage(records_channel(), at_us, record_line(stamped), stamped.seq)
        if type(stamped.record) in _SHOWN:
            return (line, *self._for_operators(stamped.record, at_us))
        return (line,)

    def _note(self, record: r.Record) -> None:
        match record:
            case r.RunStarted():
                self.started_us = record.started_us
            case r.RunPaused():
                self._paused_at_us = record.at_us
            case r.RunResumed():
                self._paused_us += max(0, record.at_us - self._paused_at_us)
                self._paused_at_us = 0
            case r.PromptOpened():
                self._prompts[record.prompt] = record

    def _for_operators(self, record: r.Record, at_us: int) -> Iterator[ChannelMessage]:
        match record:
            case r.PromptOpened():
                opened = PromptMessage(
                    self.run,
                    record.prompt,
                    "open",
                    record.element,
                    record.text,
                    record.role,
                    record.decisions,
                )
                yield ChannelMessage(prompts_channel(), at_us, _encode(opened))
            case r.PromptAnswered() | r.PromptWithdrawn():
                yield ChannelMessage(prompts_channel(), at_us, _encode(self._closed(record)))
            case r.DataWritten(key=key, value=list() as files) if key.endswith(_PICTURES):
                pictures = PicturesMessage(self.run, record.element, [str(each) for each in files])
                yield ChannelMessage(pictures_channel(), at_us, _encode(pictures))

    def _closed(self, record: r.PromptAnswered | r.PromptWithdrawn) -> PromptMessage:
        asked = self._prompts.pop(record.prompt, None)
        message = PromptMessage(self.run, record.prompt, "withdrawn")
        if asked is not None:
            message.element, message.text, message.role = asked.element, asked.text, asked.role
        if isinstance(record, r.PromptAnswered):
            message.state, message.decision, message.by = "answered", record.decision, record.by
        return message


def record_line(stamped: StampedRecord) -> bytes:
    """Return a record as a line of JSON, as `m2pem runs --export` prints it."""
    head = _encode(_Head(stamped.run, stamped.seq, stamped.t_s))
    return head[:-1] + b"," + _encode(stamped.record)[1:]
