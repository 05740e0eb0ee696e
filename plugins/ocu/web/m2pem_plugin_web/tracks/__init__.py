"""Tracks: the positions of vehicles and payloads in each run, which the journal does not have."""
