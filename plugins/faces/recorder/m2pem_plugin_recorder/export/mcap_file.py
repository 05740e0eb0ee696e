"""MCAP of a run: its recording in one whole file, with all records that the journal has."""

from collections.abc import Sequence
from typing import BinaryIO

from m2pem.api import ExportedRun, ExportOptions, LocalFrame, StampedRecord
from m2pem.errors import PluginError
from m2pem_plugin_recorder.channels import PICTURES, PROMPTS, RECORDS
from m2pem_plugin_recorder.diagrams import diagram_of
from m2pem_plugin_recorder.export.places import geometries_of
from m2pem_plugin_recorder.export.states import files_of, no_recording
from m2pem_plugin_recorder.fleets import fleet_json
from m2pem_plugin_recorder.foxglove_messages import scene_messages
from m2pem_plugin_recorder.reading import messages_of
from m2pem_plugin_recorder.record_messages import RecordEncoder
from m2pem_plugin_recorder.recording import McapFile, RecordedRun

_FROM_JOURNAL = (RECORDS, PROMPTS, PICTURES)


class McapExporter:
    """One run; see the module."""

    def __init__(self, output: BinaryIO, options: ExportOptions) -> None:
        self._output = output
        self._options = options
        self._file: McapFile | None = None
        self._remarks: list[str] = []

    def add(self, run: ExportedRun) -> None:
        """Write a run.

        Raises:
            PluginError: it is the second one.
        """
        if self._file is not None:
            raise PluginError("an MCAP file holds one run: export others into files of their own")
        summary, mission, fleet = run.summary, run.mission, run.fleet
        recorded = RecordedRun(
            summary.run,
            summary.mission,
            summary.started_us,
            () if mission is None else tuple(mission.files()),
            b"" if fleet is None else fleet_json(fleet),
            "" if fleet is None else fleet.name,
            "" if mission is None else diagram_of(mission),
        )
        file = self._file = McapFile(self._output, recorded)
        paths = files_of(run, self._options.recordings)
        for path in paths:
            for message in messages_of(path):
                if message.channel.topic not in _FROM_JOURNAL:
                    file.write(message)
        encoder = RecordEncoder(summary.run)
        for seq, _, t_s, record in run.records:
            for found in encoder.messages(StampedRecord(summary.run, seq, t_s, record)):
                file.write(found)
        if not paths:
            missing = no_recording(run, self._options.recordings)
            self._remarks.append(f"{missing}; telemetry is left out")
            if fleet is not None:
                frame = LocalFrame(fleet.origin)
                for found in scene_messages(
                    geometries_of(run), frame, fleet.fence, summary.started_us
                ):
                    file.write(found)

    def close(self) -> Sequence[str]:
        """See `m2pem.api.Exporter.close`."""
        if self._file is not None:
            self._file.finish()
        return self._remarks
