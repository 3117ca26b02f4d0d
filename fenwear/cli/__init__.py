"""The command line: parses, calls, prints; nothing else."""

from fenwear.common.stack import without

with without("rich"):  # typer would load it to draw boxes that are drawn nowhere: a tenth of a second of each command
    import typer

# In the order in which the help lists their commands.
from fenwear.cli import case_commands, state_commands, folder_commands, study_commands, about, agents  # noqa: I001
from fenwear.cli.application import UsageError, app, with_names

__all__ = [
    "UsageError",
    "about",
    "agents",
    "app",
    "case_commands",
    "folder_commands",
    "state_commands",
    "study_commands",
    "typer",
    "with_names",
]
