"""The operations of `MissionControl` over an executive, by what they are about."""
