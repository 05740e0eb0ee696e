"""What browsers are told without asking: the pictures of runs, pushed over WebSockets."""
