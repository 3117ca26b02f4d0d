"""The command line: parses, calls, prints; nothing else."""

# In the order in which the help lists their commands.
from fenwear.cli import cases, states, folders, studies, about  # noqa: I001
from fenwear.cli.base import app

__all__ = ["about", "app", "cases", "folders", "states", "studies"]
