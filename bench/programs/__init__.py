"""One piece of m2pem's work each: `python -m bench.programs.<name> ...` prints figures as JSON.

A wrong result is an exception.
"""
