"""What plugin authors import. Everything here is an interface."""
