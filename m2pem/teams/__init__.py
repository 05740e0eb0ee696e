"""One behavior of several vehicles, made of behaviors of each, on whatever arbiters they have."""
