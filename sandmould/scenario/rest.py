"""When sand is at rest: checks of its own, which no record changes."""

from __future__ import annotations

from sandmould.scenario.quantity import Section, quantity
from sandmould.scenario.sand import ARGUED


class Rest(Section):
    """Checks that end a stage in which sand comes to rest."""

    check_every_s: float = quantity(
        0.005,
        "Interval of the checks and of the guards. Loads are means over it, and the engine runs "
        "without a stop in between. Series and snapshots are written at whole checks.",
        unit="s",
        source=ARGUED,
        gt=0,
        le=100,
    )
    shaken_check_every_s: float | None = quantity(
        None,
        "The same from the first vibration on, rounded down to a whole part of check_every_s. "
        "Series and loads are then written at each of these checks. The fill keeps check_every_s, "
        "so runs with and without this key share it. On engine reference.",
        unit="s",
        source="user",
        gt=0,
        le=100,
    )
    checks: int = quantity(
        10, "Checks in a row that must find the sand at rest.", source=ARGUED, ge=1, le=1000
    )
    rms_speed_m_s: float = quantity(
        0.01,
        "Root mean square speed of all grains, weighted by mass, below which the bed is at rest.",
        unit="m/s",
        source=ARGUED,
        gt=0,
        le=10,
    )
    discharge_rms_speed_m_s: float = quantity(
        0.002,
        "The same after a discharge, where few of many grains still roll.",
        unit="m/s",
        source=ARGUED,
        gt=0,
        le=10,
    )
    load_tolerance: float | None = quantity(
        0.01,
        "Largest difference between the vertical loads on all surfaces together and the sand's "
        "weight, over that weight. null: only the speed is checked.",
        source=ARGUED,
        gt=0,
        le=10,
    )
    load_every_steps: int = quantity(
        20,
        "Steps between two samples of the loads on LAMMPS and LIGGGHTS. Checks and the coupling "
        "take means of these samples. A check holds whole samples.",
        source=ARGUED,
        ge=1,
        le=100000,
    )

    def while_shaken(self, step_s: float) -> Rest:
        """Give the checks from the first vibration on; as many as fill the same time find rest."""
        asked_s = self.shaken_check_every_s
        if asked_s is None:
            return self
        # A fill ends at one of its checks, and the next ones must go on from there as a whole.
        sample_s = self.load_every_steps * step_s
        samples = max(1, round(self.check_every_s / sample_s))
        parts = (n for n in range(1, samples + 1) if samples % n == 0)
        of_one = max((n for n in parts if n * sample_s <= asked_s), default=1)
        return self.model_copy(
            update={"check_every_s": of_one * sample_s, "checks": self.checks * samples // of_one}
        )

    def speed_limit_m_s(self, *, flows: bool) -> float:
        """The limit of a bed, or of sand that has flowed out."""
        return self.discharge_rms_speed_m_s if flows else self.rms_speed_m_s
