"""The face `mavlink`: the fleet as MAVLink systems, for ground stations (docs/mavlink-face.md)."""
