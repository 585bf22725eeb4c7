"""The command from an environment without its script: ``python -m sandmould.cli``."""

from sandmould.cli.commands import app

app(prog_name="sandmould")
