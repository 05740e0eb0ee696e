"""Simulated cameras that turn."""
