"""What the simulated camera answers, one module a service."""
