"""Executives that are killed at chosen points and random moments, and a judge of what came of it.

`python -m tests.chaos` plays rounds (`make chaos`); `tests/chaos/test_*.py` plays some of them.
"""
