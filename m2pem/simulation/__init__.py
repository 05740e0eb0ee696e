"""The built-in simulated arbiter: vehicles and payloads whose motion is a function of time."""
