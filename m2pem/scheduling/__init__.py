"""Missions that start later: entries of the schedule, and when each is due (docs/scheduling.md)."""
