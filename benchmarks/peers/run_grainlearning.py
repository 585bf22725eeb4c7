"""GrainLearning's iterative Bayesian filter, one generation after the other.

The public classes are called as its ``BayesianCalibration.run_one_iteration`` calls them, without
its percentage errors: these divide by the range of the observations, which is zero for one value,
so that its loop breaks on a single angle of repose (version 2.0.5).
"""

from __future__ import annotations

from typing import Any

import numpy as np
from grainlearning import DynamicSystem, IterativeBayesianFilter
from jsonl_pipe import JsonlPipe, serve

SAMPLES = 10
"""Of a generation, and the settings below: those of the two-parameter example in its manual."""
NO_VALUE = 0.0
"""Told for a run without a value, far from any target: the filter takes no gaps."""


def solve(pipe: JsonlPipe, problem: dict[str, Any]) -> str:
    """Run generations until the filter's own end, or on beyond it where the problem says so."""
    system = DynamicSystem.from_dict({
        "param_names": ["first", "second"],
        "param_min": problem["low"],
        "param_max": problem["high"],
        "num_samples": SAMPLES,
        "obs_data": [problem["target"]],
        "ctrl_data": [0.0],
    })  # fmt: skip
    inference = IterativeBayesianFilter.from_dict({
        "Bayes_filter": {"ess_target": 0.3},
        "sampling": {"max_num_components": 1, "random_state": problem["seed"]},
    })  # fmt: skip
    inference.add_curr_param_data_to_list(np.array(problem["start"][:SAMPLES]))
    while True:
        points = inference.param_data_list[-1]
        system.set_param_data(points)
        values = [pipe.ask(point) for point in points]
        numbers = [NO_VALUE if value is None else value for value in values]
        system.set_sim_data(np.array(numbers).reshape(SAMPLES, 1, 1))
        # The posterior is known before new points are drawn, and drawing may fail.
        inference.run_inference(system)
        weights = inference.posterior
        pipe.guess(
            {"most probable": points[int(weights.argmax())], "mean": weights @ points},
            samples=points.tolist(),
            weights=weights.tolist(),
        )
        if system.sigma_max < system.sigma_tol and not problem["go_on"]:
            return "sigma is below its tolerance"
        inference.run_sampling(system)
        system.curr_iter += 1


if __name__ == "__main__":
    serve(solve, ("grainlearning", "numpy", "scipy", "scikit-learn"))
