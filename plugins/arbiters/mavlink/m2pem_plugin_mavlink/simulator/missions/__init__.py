"""Plans (mission, fence, rally points): storing them, their protocol, flying the mission."""
