"""The fields of the contact law stand once: in the scenario, the solver and LAMMPS's callback."""

from __future__ import annotations

from typing import Any

import numba
import numpy as np
import pytest

from sandmould.dem.contact_law import Law
from sandmould.engines.lammps.bridge import law_of
from sandmould.scenario.contact import SYMBOLS, Contact, ContactLaw


def test_the_scenario_gives_all_that_the_solver_computes_with() -> None:
    contact = Contact()
    assert set(SYMBOLS.values()) == set(ContactLaw.model_fields)
    for dimension in (2, 3):
        parameters = contact.parameters(contact.grain_wall, dimension, 1e-6)
        assert set(parameters) == set(Law._fields)
        assert parameters["k_n"] == contact.grain_wall.normal_stiffness_n_m


@pytest.mark.parametrize("switches", [(True, False), (False, True)])
def test_compiled_code_reads_a_law_out_of_numbers(switches: tuple[bool, bool]) -> None:
    law = Law(1e4, 8e3, 0.4, 0.2, 0.1, 5e3, *switches)

    def read(numbers: Any) -> Any:
        return law_of(numbers)

    assert numba.njit(read)(np.array(law, dtype=float)) == law
