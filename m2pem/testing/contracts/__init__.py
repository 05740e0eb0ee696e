"""Contracts: subclass one, override its fixtures, and inherit all its tests."""
