import math

import numpy as np
import pytest

from benchmarks.frame.impact import exact
from benchmarks.stability.phases import impacts


def test_an_undamped_impact_is_of_second_order() -> None:
    """A spring alone: central differences are h^2/24 off in their frequency."""
    for step in (0.2, 0.1):
        found = impacts(1e-9, step, corrected=False)
        assert found.contact_time.mean() == pytest.approx(math.pi, rel=step * step / 12)
        assert found.restitution.mean() == pytest.approx(1.0, rel=step * step / 12)


@pytest.mark.parametrize("damping_ratio", [0.2, 1.0])
@pytest.mark.parametrize("corrected", [False, True])
def test_all_comes_to_the_exact_impact(damping_ratio: float, corrected: bool) -> None:
    """At first order in the step: a tenth of the step leaves a tenth of the error."""
    off = [
        [abs(x.mean() / value - 1.0) for x, value in zip(found, exact(damping_ratio), strict=True)]
        for found in (impacts(damping_ratio, step, corrected) for step in (0.02, 0.002))
    ]
    # what is of second order already may be round-off of the 256 places
    assert np.all(np.array(off[1]) < 0.12 * np.array(off[0]) + 1e-5)


def test_the_correction_takes_the_bias_of_the_mean_restitution() -> None:
    plain, corrected = (impacts(1.0, 0.2, c).restitution.mean() for c in (False, True))
    value = float(exact(1.0).restitution)
    assert plain < 0.9 * value
    # (omega dt)^2 / 8 is what c' leaves, as in the verification on the engines
    assert corrected == pytest.approx(value, rel=0.2**2 / 8)
