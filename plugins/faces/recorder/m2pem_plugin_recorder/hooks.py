"""The hooks of this plugin: the faces `recorder` and `foxglove`, and the formats of exports."""

from collections.abc import Callable
from importlib import import_module
from typing import TYPE_CHECKING, Any

from m2pem import hookimpl

if TYPE_CHECKING:
    from m2pem.api import Exporter, ExportOptions, Face


@hookimpl
def m2pem_register_faces(register: "Callable[[str, Callable[..., Face]], None]") -> None:
    """Register `recorder` and `foxglove`."""
    from m2pem_plugin_recorder.faces import FoxgloveFace, RecorderFace  # noqa: PLC0415

    register("recorder", RecorderFace)
    register("foxglove", FoxgloveFace)


@hookimpl
def m2pem_register_exporters(register: "Callable[[str, Callable[..., Exporter]], None]") -> None:
    """Register the formats of `m2pem export`."""
    for name, (module, exporter) in _EXPORTERS.items():
        register(name, _ImportedWhenMade(module, exporter, writes_folder=name == "rosbag2"))


_EXPORTERS = {
    "csv": ("tables", "CsvExporter"),
    "parquet": ("tables", "ParquetExporter"),
    "geojson": ("places", "GeoJsonExporter"),
    "kml": ("places", "KmlExporter"),
    "xes": ("xes", "XesExporter"),
    "mcap": ("mcap_file", "McapExporter"),
    "rosbag2": ("rosbag2_folder", "Rosbag2Exporter"),
}


class _ImportedWhenMade:
    """Makes an exporter of a module of `export`. `writes_folder`: see `m2pem.api.Exporter`."""

    def __init__(self, module: str, exporter: str, *, writes_folder: bool) -> None:
        self._module, self._exporter = f"m2pem_plugin_recorder.export.{module}", exporter
        self.writes_folder = writes_folder

    def __call__(self, output: Any, options: "ExportOptions") -> "Exporter":
        made: Exporter = getattr(import_module(self._module), self._exporter)(output, options)
        return made
