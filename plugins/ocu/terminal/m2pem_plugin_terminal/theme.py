"""Calm colours: slate, with green for work, amber for what waits for the operator, red for STOP."""

from textual.theme import Theme

THEME = Theme(
    name="m2pem",
    primary="#8ab4d8",
    secondary="#7fc8a9",
    accent="#e8c468",
    warning="#e8c468",
    error="#e07a6a",
    success="#7fc8a9",
    foreground="#c8d0d9",
    background="#1b2129",
    surface="#222a33",
    panel="#2a333e",
    dark=True,
)
