"""The behaviors of the catalogue, in terms of a vehicle and its driver: one class each."""
