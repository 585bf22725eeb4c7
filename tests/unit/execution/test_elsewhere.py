"""Whether a start of Snakemake may send jobs to other machines."""

from __future__ import annotations

import pytest

from sandmould.execution.cluster.settings import may_be_elsewhere


@pytest.mark.parametrize(
    ("arguments", "is_so"),
    [
        (["snakemake", "--cores", "2"], False),
        (["snakemake", "--workflow-profile", "profiles/slurm"], True),
        (["snakemake", "--executor=slurm"], True),
        (["snakemake", "-e", "slurm"], True),
    ],
)
def test_options_that_choose_an_executor_may(
    arguments: list[str], is_so: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("SNAKEMAKE_PROFILE", raising=False)
    assert may_be_elsewhere(arguments) is is_so


def test_a_profile_of_the_environment_may(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SNAKEMAKE_PROFILE", "slurm")
    assert may_be_elsewhere(["snakemake", "--cores", "2"])
