"""Files that others drew: m2pem loads each of them, or refuses it with findings that help."""
