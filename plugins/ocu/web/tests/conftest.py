"""Fixtures of the web page's tests."""
