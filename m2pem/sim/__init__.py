"""The built-in simulated arbiter: vehicles and payloads on any clock."""
