"""Access over HTTP: users and roles, sessions, tokens, passwords, hosts and origins."""
