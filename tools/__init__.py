"""Programs for who works on m2pem: `python -m tools.NAME`, most with `--help`."""
