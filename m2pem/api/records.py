"""Records, as OCUs and observers read them (docs/records.md)."""

from m2pem.engine.records import *  # noqa: F403  # every record
