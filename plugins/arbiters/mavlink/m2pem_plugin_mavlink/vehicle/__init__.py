"""One vehicle: what is known of it, whether it is ready, and how it is driven."""
