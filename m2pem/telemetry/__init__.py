"""Telemetry of the fleet, and what of it becomes an input."""
