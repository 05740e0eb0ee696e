"""Cursor on Target: the fleet on the maps of TAK, and their markers as geometries."""

from m2pem_plugin_cot.hooks import m2pem_register_faces

__all__ = ["m2pem_register_faces"]
