"""The process that renders templates of users: run by path, it knows nothing of the house.

Requests come as lines of JSON on its standard input, each with ``template`` and, where the deck is
wanted, ``values``; answers go as lines of JSON to its standard output. A template that reaches past
Jinja's sandbox finds a process that may open no more files, start no process and hold no key.
"""

from __future__ import annotations

import codecs
import html
import json
import math
import pprint
import resource
import signal
import sys
import textwrap
import traceback
from collections.abc import Iterable
from functools import lru_cache
from typing import Any

import jinja2
import jinja2.constants
import jinja2.debug
from jinja2 import meta
from jinja2.sandbox import ImmutableSandboxedEnvironment

# Without a loader: what a template includes from elsewhere no hash would know.
_ENVIRONMENT = ImmutableSandboxedEnvironment(
    undefined=jinja2.StrictUndefined, keep_trailing_newline=True, autoescape=False
)


def _prime(seed: int) -> int:
    """A prime above 10 000, as LIGGGHTS wants its seeds: another one for each seed below 7 000 000.

    Primes below 2**31 lie less than 300 apart.
    """
    number = 10_001 + 300 * (int(seed) % 7_000_000)
    while any(number % divisor == 0 for divisor in range(3, math.isqrt(number) + 1, 2)):
        number += 2
    return number


_ENVIRONMENT.filters["prime"] = _prime


class _TooMuchError(Exception):
    """A deck longer than its limit."""


# Jinja and Python import these when a template first needs them, where no file can be opened.
_LOADED = (html, jinja2.constants, jinja2.debug, pprint, textwrap)
_FIRST = ("{{ 'text'|upper|string|escape }}", "{{ 1 / 0 }}", "{{ ''.__class__ }}", "{% if %}")
_CODECS = ("unicode_escape", "ascii", "latin-1", "utf-8", "idna", "punycode")


def _confine(memory_bytes: int) -> None:
    """Take from this process what rendering does not need."""
    for what, most in (
        (resource.RLIMIT_AS, memory_bytes),
        (resource.RLIMIT_FSIZE, 0),
        (resource.RLIMIT_CORE, 0),
        (resource.RLIMIT_NPROC, 0),
        (resource.RLIMIT_NOFILE, 3),
    ):
        resource.setrlimit(what, (most, most))


@lru_cache(maxsize=8)
def _compiled(text: str) -> tuple[list[str], jinja2.Template]:
    """Names that a template takes from outside, and the template."""
    names = meta.find_undeclared_variables(_ENVIRONMENT.parse(text))
    return sorted(names), _ENVIRONMENT.from_string(text)


def _joined(parts: Iterable[str], most: int) -> str:
    """All parts of a deck, as long as they are few enough."""
    kept, characters = [], 0
    for part in parts:
        characters += len(part)
        if characters > most:
            raise _TooMuchError(f"it makes more than {most:,} characters")
        kept.append(part)
    return "".join(kept)


def _answer(request: dict[str, Any], most_characters: int) -> dict[str, Any]:
    """What a request asks for, or why there is none."""
    try:
        names, template = _compiled(request["template"])
        if "values" not in request:
            return {"names": names}
        return {"deck": _joined(template.generate(request["values"]), most_characters)}
    except MemoryError:
        return {"fault": "it takes more memory than it may", "line": None}
    except RecursionError:
        return {"fault": "it is nested too deeply", "line": None}
    except Exception as error:  # a template can raise anything
        fault = str(error).partition("\n")[0] or type(error).__name__
        return {"fault": fault, "line": _line_of(error)}


def _line_of(error: Exception) -> int | None:
    """Line of a template that an error comes from."""
    if isinstance(error, jinja2.TemplateSyntaxError):
        return error.lineno
    places = traceback.walk_tb(error.__traceback__)
    lines = [line for frame, line in places if frame.f_code.co_filename == "<template>"]
    return lines[-1] if lines else None


def main(memory_bytes: int, most_characters: int, cpu_s: float) -> None:
    """Answer requests until there are no more; a request that takes too long ends the process."""
    for codec in _CODECS:
        codecs.lookup(codec)
    for text in _FIRST:
        _answer({"template": text, "values": {}}, most_characters)
    _confine(memory_bytes)
    for line in sys.stdin:
        signal.setitimer(signal.ITIMER_PROF, cpu_s)
        answer = json.dumps(_answer(json.loads(line), most_characters))
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        print(answer, flush=True)


if __name__ == "__main__":
    try:
        limits = int(sys.argv[1]), int(sys.argv[2]), float(sys.argv[3])
    except (IndexError, ValueError):
        sys.exit("usage: started by the renderer alone: MEMORY_BYTES MOST_CHARACTERS CPU_S")
    main(*limits)
