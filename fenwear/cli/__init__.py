"""The command line: parses, calls, prints; nothing else."""

from fenwear.stack import without

with without("rich"):  # typer would load it to draw boxes that are drawn nowhere: a tenth of a second of each command
    import typer

# In the order in which the help lists their commands.
from fenwear.cli import cases, states, folders, studies, about, agents  # noqa: I001
from fenwear.cli.base import UsageError, app, with_names

__all__ = ["UsageError", "about", "agents", "app", "cases", "folders", "states", "studies", "typer", "with_names"]
