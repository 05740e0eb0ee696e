"""Flight recorder, live view for Foxglove, and exports of runs (docs/recording.md)."""

from m2pem_plugin_recorder.hooks import m2pem_register_exporters, m2pem_register_faces

__all__ = ["m2pem_register_exporters", "m2pem_register_faces"]
