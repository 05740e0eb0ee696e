"""Deconfliction: each behavior of an aircraft reserves an operational volume of its own."""
