"""Templates of pages, and figures of a report as files, for slides, papers and records."""

from __future__ import annotations

import base64
import io
import shutil
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

from jinja2 import Environment, FileSystemLoader, StrictUndefined
from jinja2.sandbox import ImmutableSandboxedEnvironment

from sandmould import SHIPPED
from sandmould.drawing.chart import WIDE, Chart, lay_out
from sandmould.kept_templates import kept_templates
from sandmould.runs.formatting import number, opened

TEMPLATES = SHIPPED / "templates" / "report"
_PICTURE_IN = 4.2
_HEADING_IN = 0.3
"""Width of a picture in a strip, and room over it, inches."""


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


def strip(panels: Sequence[tuple[str, str]]) -> bytes:
    """Pictures of one size (heading, ``data:`` address) side by side, as one PNG."""
    from matplotlib.figure import Figure  # slow to import, and few reports have a strip
    from PIL import Image

    from sandmould.drawing.figures import png_bytes

    images = [
        (heading, Image.open(io.BytesIO(_image_bytes(address)))) for heading, address in panels
    ]
    width, height = images[0][1].size
    picture_in = _PICTURE_IN * height / width
    tall_in, share = picture_in + _HEADING_IN, 1.0 / len(images)
    figure = Figure(figsize=(_PICTURE_IN * len(images), tall_in), dpi=100)
    for place, (heading, image) in enumerate(images):
        axes = figure.add_axes((place * share, 0.0, share, picture_in / tall_in))
        axes.imshow(image.convert("RGB"), interpolation="antialiased")
        axes.set_title(heading, fontsize=11, parse_math=False)
        axes.set_axis_off()
    return png_bytes(figure)


def pictures(**addresses: str) -> dict[str, bytes]:
    """Pictures by name from their ``data:`` addresses, without those that are empty."""
    return {name: _image_bytes(address) for name, address in addresses.items() if address}


def _image_bytes(address: str) -> bytes:
    """The file that a ``data:`` address holds."""
    return base64.b64decode(address.partition(",")[2])


def numbered(name: str, charts: Iterable[Chart]) -> dict[str, Chart]:
    """Charts by name: the first has it as it is, others their number too."""
    return {f"{name}_{n}" if n > 1 else name: chart for n, chart in enumerate(charts, 1)}


def write_figures(
    folder: Path, environment: Environment, files: Mapping[str, Chart | bytes]
) -> None:
    """Write a folder of figures anew: charts as SVG in the page's colours, pictures as PNG.

    ``files``: by name without its ending.
    """
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir()
    template = environment.get_template("figure.svg")
    for name, what in files.items():
        if isinstance(what, bytes):
            (folder / f"{name}.png").write_bytes(what)
        else:
            text = template.render(laid=lay_out(what, WIDE))
            (folder / f"{name}.svg").write_text(text, encoding="utf-8")
