"""The model of a camera on a vehicle: pose, field of view, footprint, and coverage of an area."""
