"""The command line: parses, calls, prints; nothing else."""

# In the order in which the help lists their commands.
from fenwear.cli import cases, states, shape, folders, studies, about  # noqa: I001
from fenwear.cli.base import UsageError, app

__all__ = ["UsageError", "about", "app", "cases", "folders", "shape", "states", "studies"]
