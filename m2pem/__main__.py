"""`python -m m2pem`: the command line."""

from m2pem.cli import main

main()
