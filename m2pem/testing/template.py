"""The folder of the plugin template: `copier copy "$(python -m m2pem.testing.template)" FOLDER`."""

from pathlib import Path

_INSTALLED = Path(__file__).parents[1] / "templates" / "plugin"
_CHECKOUT = Path(__file__).parents[2] / "templates" / "plugin"


def folder() -> Path:
    """Return the template's folder, in an installation or in a checkout of the sources."""
    return _INSTALLED if _INSTALLED.is_dir() else _CHECKOUT


if __name__ == "__main__":
    print(folder())
