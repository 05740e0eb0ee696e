"""A simulated ONVIF camera that turns, over HTTP."""
