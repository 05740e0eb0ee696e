"""Updates over WebSockets: views of runs, prompts and states of the fleet."""
