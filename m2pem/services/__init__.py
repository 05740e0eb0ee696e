"""The built-in services: what a service task can call with no plugin installed."""
