"""The programs of ArduPilot and PX4 themselves, as software in the loop (docs/mavlink.md)."""
