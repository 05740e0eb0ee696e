"""A bag of ROS 2 of a run: a folder with `metadata.yaml` and one MCAP file, all of it CDR.

A recording has JSON and protobuf beside CDR, which rosbag2 and rosbags refuse to open. Here the
states are made into messages of ROS again, and what is JSON there is `std_msgs/msg/String`. The
bag says the types of its topics itself: their definitions, and their hashes (REP-2016).
"""

import heapq
import re
from collections.abc import Container, Sequence
from itertools import chain, count
from pathlib import Path

from rosbags.interfaces import (
    Connection,
    Qos,
    QosDurability,
    QosHistory,
    QosLiveliness,
    QosReliability,
    QosTime,
)
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer

from m2pem.api import ExportedRun, ExportOptions, LocalFrame, StampedRecord
from m2pem.errors import PluginError
from m2pem_plugin_recorder.export.states import States
from m2pem_plugin_recorder.record_messages import RecordEncoder
from m2pem_plugin_recorder.recording import NS_PER_US
from m2pem_plugin_recorder.ros_messages import STORE
from m2pem_plugin_recorder.telemetry_messages import TelemetryEncoder

_STRING = "std_msgs/msg/String"
_NOT_IN_NAMES = re.compile(r"[^A-Za-z0-9_/]|(?<=/)(?=[0-9])")
"""What becomes "_" in names of ROS, none of whose parts begins with a digit."""


_NO_BOUND = QosTime(0, 0)
_QOS = Qos(
    QosHistory.KEEP_LAST,
    100,
    QosReliability.RELIABLE,
    QosDurability.VOLATILE,
    _NO_BOUND,
    _NO_BOUND,
    QosLiveliness.AUTOMATIC,
    _NO_BOUND,
    avoid_ros_namespace_conventions=False,
)
"""With which `ros2 bag play` publishes: subscriptions of any reliability get it."""


class Rosbag2Exporter:
    """One run; see the module. It makes the folder `output`."""

    def __init__(self, output: Path, options: ExportOptions) -> None:
        self._output = output
        self._states = States(options.recordings)
        self._run = ""

    def add(self, run: ExportedRun) -> None:
        """Write a run.

        Raises:
            PluginError: it is the second one, or its fleet cannot be read.
        """
        name = run.summary.run
        if self._run:
            raise PluginError("a bag holds one run: export others into folders of their own")
        if run.fleet is None:
            raise PluginError(f"{name}: its fleet cannot be read, so that poses have no origin")
        self._run = name
        connections: dict[str, Connection] = {}
        # Version 9 of metadata.yaml is that of rosbag2 in Jazzy.
        writer = Writer(self._output, version=9, storage_plugin=StoragePlugin.MCAP)
        writer.set_compression(CompressionMode.STORAGE, CompressionFormat.ZSTD)
        writer.set_custom_data("m2pem_run", name)
        with writer:
            # Both are in the order of their times, but for clocks that were set back.
            telemetry, records = TelemetryEncoder(LocalFrame(run.fleet.origin)), RecordEncoder(name)
            both = (
                (each for state in self._states.of(run) for each in telemetry.messages(state)),
                (
                    each
                    for seq, _, t_s, record in run.records
                    for each in records.messages(StampedRecord(name, seq, t_s, record))
                ),
            )
            for found in heapq.merge(*both, key=lambda message: message.time_us):
                if found.channel.encoding == "protobuf":
                    continue  # the same is there as a message of ROS or as JSON
                is_cdr = found.channel.encoding == "cdr"
                topic = found.channel.topic
                type_ = found.channel.schema.name if is_cdr else _STRING
                if topic not in connections:
                    taken = {each.topic for each in connections.values()}
                    connections[topic] = writer.add_connection(
                        _ros_name(topic, taken), type_, typestore=STORE, offered_qos_profiles=[_QOS]
                    )
                data = found.data if is_cdr else _string(found.data)
                writer.write(connections[topic], max(0, found.time_us) * NS_PER_US, data)

    def close(self) -> Sequence[str]:
        """See `m2pem.api.Exporter.close`."""
        return self._states.remarks


def _ros_name(topic: str, taken: Container[str]) -> str:
    """Return a name that ROS takes and no other topic of the bag has."""
    name = _NOT_IN_NAMES.sub("_", topic)
    others = (f"{name}_{number}" for number in count(2))
    return next(each for each in chain((name,), others) if each not in taken)


def _string(text: bytes) -> bytes:
    message = STORE.types[_STRING](data=text.decode())
    return bytes(STORE.serialize_cdr(message, _STRING))
