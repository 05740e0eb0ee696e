"""The operations of `MissionControl`, by what they are about."""
