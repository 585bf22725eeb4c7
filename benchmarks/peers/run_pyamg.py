"""A system by PyAMG: smoothed aggregation as a preconditioner of conjugate gradients.

``python run_pyamg.py FOLDER TOLERANCE TIMES`` reads matrix.npz and right.npy and prints one JSON
object: iterations, residual over right-hand side, and the median of processor seconds.
"""

from __future__ import annotations

import json
import os
import sys
import time
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")

import numpy as np
import pyamg
from scipy.sparse import csr_matrix, load_npz


def main(folder: Path, tolerance: float, times: int) -> None:
    """Set up and solve so many times, once before that."""
    matrix, right = csr_matrix(load_npz(folder / "matrix.npz")), np.load(folder / "right.npy")
    spent_s = []
    for _ in range(times + 1):
        residuals: list[float] = []
        begin = time.process_time()
        levels = pyamg.smoothed_aggregation_solver(matrix)
        solution = levels.solve(right, tol=tolerance, accel="cg", residuals=residuals)
        spent_s.append(time.process_time() - begin)
    left = np.linalg.norm(right - matrix @ solution) / np.linalg.norm(right)
    answer = {
        "version": pyamg.__version__, "iterations": len(residuals) - 1,
        "residual_fraction": float(left), "cpu_s": float(np.median(spent_s[1:])),
    }  # fmt: skip
    print(json.dumps(answer))


if __name__ == "__main__":
    main(Path(sys.argv[1]), float(sys.argv[2]), int(sys.argv[3]))
