"""Files of many geometries, as other programs read and write them.

`read_geometry_file` reads any of `READ_SUFFIXES`; `write_geometry_file` writes any `FileFormat`.
"""

from m2pem.geo.geometry_files.contents import FileProblem, GeometryFile, NamedGeometry
from m2pem.geo.geometry_files.formats import (
    MAX_BYTES,
    READ_SUFFIXES,
    FileFormat,
    read_geometry_file,
    write_geometry_file,
)
from m2pem.geo.geometry_files.mission_commands import KEEP_OUT

__all__ = [
    "KEEP_OUT",
    "MAX_BYTES",
    "READ_SUFFIXES",
    "FileFormat",
    "FileProblem",
    "GeometryFile",
    "NamedGeometry",
    "read_geometry_file",
    "write_geometry_file",
]
