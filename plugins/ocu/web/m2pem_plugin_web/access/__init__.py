"""Who may do what over HTTP: people and roles, sessions, tokens, passwords, hosts and origins."""
