"""One vehicle: its state, its modes, whether it may be armed, and the drivers of autopilots."""
