"""The hooks of this plugin: the faces `recorder` and `foxglove`, and the formats of exports."""

from collections.abc import Callable
from importlib import import_module
from typing import TYPE_CHECKING, BinaryIO

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
        register(name, _imported_when_made(f"m2pem_plugin_recorder.export.{module}", exporter))


_EXPORTERS = {
    "csv": ("tables", "CsvExporter"),
    "parquet": ("tables", "ParquetExporter"),
    "geojson": ("places", "GeoJsonExporter"),
    "kml": ("places", "KmlExporter"),
    "xes": ("xes", "XesExporter"),
    "mcap": ("mcap_file", "McapExporter"),
}


def _imported_when_made(module: str, exporter: str) -> "Callable[..., Exporter]":
    def make(output: BinaryIO, options: "ExportOptions") -> "Exporter":
        made: Exporter = getattr(import_module(module), exporter)(output, options)
        return made

    return make
