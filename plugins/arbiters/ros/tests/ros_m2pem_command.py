"""`m2pem` with all its commands, as a person types them, with `--ros-args` too."""

from m2pem.cli import main

if __name__ == "__main__":
    main()
