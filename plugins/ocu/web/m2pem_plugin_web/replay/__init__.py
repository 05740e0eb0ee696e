"""Ended runs of any length, opened at any moment: snapshots of views, and records by pages."""
