"""What people who draw missions need of m2pem: a file as an editor takes it, and what is in it."""
