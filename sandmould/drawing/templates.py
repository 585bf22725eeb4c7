"""The templates of pages."""

from __future__ import annotations

from jinja2 import Environment, FileSystemLoader, StrictUndefined
from jinja2.sandbox import ImmutableSandboxedEnvironment

from sandmould import SHIPPED
from sandmould.kept_templates import kept_templates
from sandmould.runs.formatting import number, opened

TEMPLATES = SHIPPED / "templates" / "report"


def page_environment() -> Environment:
    """Templates of pages: names are escaped, and a missing value is an error."""
    environment = ImmutableSandboxedEnvironment(
        loader=FileSystemLoader(TEMPLATES),
        undefined=StrictUndefined,
        bytecode_cache=kept_templates(),
        autoescape=True,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters |= {"number": number, "opened": opened}
    return environment
