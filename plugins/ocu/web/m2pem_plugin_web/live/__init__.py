"""What is pushed to browsers over WebSockets: views of runs, prompts and states of the fleet."""
