"""Firmwares: how ArduPilot and PX4 differ. All else is the same vehicle."""
