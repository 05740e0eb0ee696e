"""Conformance of vehicles to what behaviors command them, by their telemetry (docs/evidence.md)."""
