"""What a table did in each period of its vibration: amplitudes, phase and energies."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from sandmould.geometry.geometry import Array
from sandmould.scenario.vibration import STANDARD_GRAVITY_M_S2

if TYPE_CHECKING:  # compiled: no plan waits for it
    from sandmould.dem.table import MountedTable, TableDrive


@dataclass(frozen=True)
class TablePeriod:
    """One row of ``table.tsv``: a period of the vibration of a table on mounts."""

    stage: str
    vibration_time_s: float
    """Of its end."""
    displacement_m: float
    """Amplitude of the table's motion at the frequency of the drive, that of its acceleration over
    omega^2: a slow swing on the mounts hardly shows in it."""
    phase_deg: float
    """By which that motion lags the force of the rotating masses."""
    largest_displacement_m: float
    """Half the way between the highest and the lowest place."""
    largest_acceleration_g: float
    """Largest magnitude, impacts of the sand included."""
    unbalance_work_j: float
    """Work of the rotating masses on the table."""
    mount_loss_j: float
    """What the dashpots of the mounts take."""
    sand_work_j: float
    """Work of the table on the sand, over that of its resting weight."""
    table_energy_j: float
    """Kinetic and elastic energy of table and mounts at the end of the period."""

    def cells(self) -> dict[str, str]:
        """Values by column, as the table holds them."""
        return {
            name: value if isinstance(value, str) else f"{value:.9g}"
            for name, value in asdict(self).items()
        }


class Window(NamedTuple):
    """A stretch of the table's motion, in steps; the fields are columns of ``TablePeriods``."""

    time_s: Array
    place_m: Array
    acceleration_m_s2: Array
    unbalance_work_j: Array
    mount_loss_j: Array
    sand_work_j: Array
    energy_j: Array


def window_of(
    table: MountedTable, drive: TableDrive, places_m: Array, times_s: Array, step_s: float
) -> Window:
    """Accelerations and works of every step, which sum to the change of energy but for round-off.

    ``places_m``: (steps + 2,) float64, m; ``times_s``: (steps,) float64, s.
    """
    before, now, after = places_m[:-2], places_m[1:-1], places_m[2:]
    way, speed = 0.5 * (after - before), 0.5 * (after - before) / step_s
    acceleration = (after - 2 * now + before) / step_s**2
    inertia = table.mass_kg * acceleration
    damping = drive.damping_kg_s * speed
    # The equation of motion gives the force of the sand: what no other term explains.
    on_sand = drive.push_n - inertia - damping - table.stiffness_n_m * now
    kinetic = 0.5 * table.mass_kg * ((after - now) / step_s) ** 2
    return Window(
        times_s,
        now,
        acceleration,
        drive.push_n * way,
        damping * way,
        on_sand * way,
        kinetic + 0.5 * table.stiffness_n_m * now * after,
    )


class TablePeriods:
    """Collects windows of a stage of vibration and gives a row for each whole period."""

    def __init__(self) -> None:
        self.steps: Array = np.empty((0, len(Window._fields)))
        """(n, 7) float64: the period that has begun, a row a step, columns as in ``Window``."""

    def add(
        self, stage: str, frequency_hz: float, periods: int, offset_s: float, window: Window
    ) -> list[TablePeriod]:
        """Take in a window; gives the periods that have ended in it.

        ``periods``: of the stage; steps after the last one are left out. ``offset_s``: time of
        vibration when the stage began.
        """
        self.steps = np.concatenate([self.steps, np.column_stack(window)])
        number = np.floor(self.steps[:, 0] * frequency_hz + 1e-9).astype(np.int64)
        rows = []
        for period in range(max(0, int(number[0])), min(int(number[-1]), periods)):
            steps = Window(*self.steps[number == period].T)
            time_s = offset_s + (period + 1) / frequency_hz
            rows.append(_period(stage, time_s, frequency_hz, steps))
        ended = number[-1] >= periods
        self.steps = self.steps[:0] if ended else self.steps[number == number[-1]]
        return rows


def _period(stage: str, time_s: float, frequency_hz: float, steps: Window) -> TablePeriod:
    omega = 2.0 * np.pi * frequency_hz
    turned = steps.acceleration_m_s2 * np.exp(-1j * omega * steps.time_s)
    # -omega^2 A sin(omega t - phase) has the coefficient i omega^2 A exp(-i phase) / 2.
    wave = -2j * complex(turned.mean()) / omega**2
    lag = -math.degrees(np.angle(wave)) % 360.0
    return TablePeriod(
        stage,
        time_s,
        float(abs(wave)),
        lag,
        0.5 * float(np.ptp(steps.place_m)),
        float(np.abs(steps.acceleration_m_s2).max()) / STANDARD_GRAVITY_M_S2,
        float(steps.unbalance_work_j.sum()),
        float(steps.mount_loss_j.sum()),
        float(steps.sand_work_j.sum()),
        float(steps.energy_j[-1]),
    )
