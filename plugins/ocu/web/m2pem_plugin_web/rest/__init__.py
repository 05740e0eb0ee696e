"""What browsers ask for over HTTP: one router a module."""
