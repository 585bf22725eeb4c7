"""Templates of users make text and nothing else, within limits that are told in a sentence."""

from __future__ import annotations

import math
import os
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from jinja2.filters import FILTERS
from jinja2.sandbox import ImmutableSandboxedEnvironment

from sandmould.engines.deck import environment
from sandmould.kinds.deck.own import template
from sandmould.kinds.deck.own.template import TemplateError, names_in, rendered

NESTED = "{% for i in range(99999) %}{% for j in range(99999) %}{% endfor %}{% endfor %}"


@pytest.fixture
def narrow(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """A process with little time."""
    monkeypatch.setattr(template, "CPU_S", 0.3)
    template._process_of.cache_clear()
    yield
    template._process_of.cache_clear()


def test_a_template_starts_no_program(tmp_path: Path) -> None:
    proof = tmp_path / "proof"
    hostile = (
        f"{{{{ cycler.__init__.__globals__.os.popen('touch {proof}').read() }}}}",
        f"{{{{ ''.__class__.__mro__[1].__subclasses__() }}}}{proof}",
        f"{{{{ x.__class__.__init__.__globals__ }}}}{proof}",
        f"{{{{ '{{0.__class__.__mro__}}'.format(x) }}}}{proof}",
        f"{{{{ (x|attr('__class__')).mro() }}}}{proof}",
        "{{ namespace.__init__.__globals__ }}",
    )
    for text in hostile:
        with pytest.raises(TemplateError, match=r"line 1: .*(unsafe|undefined)"):
            rendered(text, {"x": "text"})
    assert not proof.exists()


def test_the_process_may_do_no_more_than_render() -> None:
    rendered("{{ a }}", {"a": 1})
    of_process = Path("/proc") / str(template._process_of(os.getpid())._process.pid)
    limits = (of_process / "limits").read_text()
    for name, most in (("open files", 3), ("processes", 0), ("file size", 0)):
        assert re.search(rf"^Max {name} +{most} +{most} ", limits, re.M)
    assert re.search(rf"^Max address space +{template.MEMORY_BYTES} ", limits, re.M)
    environment_names = (of_process / "environ").read_text().split("=")[0]
    assert environment_names in ("", "LD_LIBRARY_PATH")
    assert (of_process / "cwd").readlink() == Path("/")


def test_what_is_given_is_not_changed() -> None:
    with pytest.raises(TemplateError, match="'append' of 'list' object is unsafe"):
        rendered("{{ x.append(1) }}", {"x": [1]})


def test_the_line_of_a_fault_is_told() -> None:
    with pytest.raises(TemplateError, match=r"^line 3: division by zero$"):
        rendered("units si\n\n{{ 1 / 0 }}", {})
    with pytest.raises(TemplateError, match=r"^line 2: "):
        names_in("units si\n{% if %}")


@pytest.mark.parametrize(
    ("text", "told"),
    [
        (NESTED, "it takes more than 0.3 s of processor time"),
        ("{{ 'x' * 10 ** 10 }}", "it takes more memory than it may"),
        ("{% for i in range(99999) %}{{ 'x' * 1000 }}{% endfor %}", "more than 10,000,000 charac"),
        ("{% for i in range(1000000) %}{% endfor %}", "line 1: Range too big"),
        ("{{ " + "(" * 5000 + "1" + ")" * 5000 + " }}", "it is nested too deeply"),
        ("x" * 10_000_001, "it has more than 10,000,000 characters"),
    ],
    ids=["time", "memory", "output", "range", "depth", "input"],
)
@pytest.mark.usefixtures("narrow")
def test_a_limit_is_told_and_the_next_template_renders(text: str, told: str) -> None:
    with pytest.raises(TemplateError, match=told):
        rendered(text, {})
    assert rendered("run {{ n }}", {"n": 10}) == "run 10"


def test_a_template_that_waits_is_ended(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(template, "WALL_S", 0.0)
    with pytest.raises(TemplateError, match="it takes longer than 0 s"):
        rendered("{{ 1 }}", {})


ARGUMENTS: dict[str, tuple[Any, ...]] = {
    "attr": ("x",), "batch": (2,), "format": (1,), "groupby": ("a",), "join": (",",), "map": ("a",),
    "replace": ("a", "b"), "selectattr": ("a",), "rejectattr": ("a",), "slice": (2,),
    "wordwrap": (3,), "default": (1,), "round": (1,),
}  # fmt: skip


def test_every_filter_works_where_no_file_can_be_opened() -> None:
    for name in sorted(FILTERS):
        given = ARGUMENTS.get(name, ())
        for value in ("a b", 1.5, [{"a": 1}], {"a": 1}):
            text = f"{{{{ (x|{name}{given!r})|string }}}}".replace(",)", ")").replace("()", "")
            try:
                rendered(text, {"x": value})
            except TemplateError as fault:
                told = str(fault)
                assert "Errno" not in told, (name, value)
                assert ".py" not in told, (name, value)
                assert "ended" not in told, (name, value)


def test_liggghts_takes_each_seed_as_a_prime() -> None:
    seeds = [*range(300), 6_999_999, 2**31 - 1]
    text = "{% for n in seeds %}{{ n | prime }} {% endfor %}"
    primes = [int(word) for word in rendered(text, {"seeds": seeds}).split()]
    assert len(set(primes)) == len(seeds)
    assert primes[:2] == [10_007, 10_301]
    for prime in primes:
        assert 10_000 < prime < 2**31
        assert all(prime % divisor for divisor in range(2, math.isqrt(prime) + 1))


def test_a_forked_process_has_its_own() -> None:
    assert rendered("{{ a }}", {"a": 1}) == "1"
    child = os.fork()
    if child == 0:
        os._exit(0 if rendered("{{ a }}", {"a": 2}) == "2" else 1)
    assert os.waitpid(child, 0)[1] == 0
    assert rendered("{{ a }}", {"a": 3}) == "3"


@pytest.mark.parametrize("dialect", ["lammps", "liggghts", "reference"])
def test_shipped_templates_render_in_the_sandbox_too(dialect: str) -> None:
    assert isinstance(environment(dialect), ImmutableSandboxedEnvironment)
