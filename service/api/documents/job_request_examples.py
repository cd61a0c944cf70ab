"""Example requests for jobs in the OpenAPI document."""

from __future__ import annotations

from typing import Any

EXAMPLES: Any = {
    "grid": {
        "summary": "A grid: 26 friction coefficients times 61 start angles",
        "value": {
            "scene": "spherical_pendulum",
            "overrides": {"joints.ball.start.q": {"axis": [0, 1, 0], "angle": 0}},
            "vary": {"joints.ball.friction.mu": "0.1:0.6:26", "joints.ball.start.q.angle": "-30 deg:30 deg:61"},
            "reductions": ["max:ball.contact[1].normal_force", "first:reversal"],
            "until": 5,
        },
    },
    "list": {
        "summary": "A list of cases",
        "value": {
            "scene": "crank_slider",
            "cases": [{"joints.slider_pin.friction.mu": 0.1}, {"joints.slider_pin.friction.mu": 0.3}],
            "until": 1,
        },
    },
    "sample": {
        "summary": "A Latin hypercube",
        "value": {
            "scene": "spherical_pendulum",
            "sample": {"ranges": {"joints.ball.friction.mu": [0.1, 0.6], "gravity[3]": [-9.9, -9.7]}, "count": 200, "seed": 1},
            "until": 1,
        },
    },
    "optimise": {
        "summary": "A study that finds the best parameter values; /answer returns the result",
        "value": {
            "scene": "double_pendulum",
            "optimise": {
                "bounds": {"joints.guide.friction.mu": [0.05, 0.5], "joints.guide.friction.half_length": ["100 mm", "400 mm"]},
                "reach": ["final:guide.q[1]", "5 m"],
                "within": {"max:guide.contact[1].normal_force": [None, "20 kN"]},
                "cases": 200,
            },
            "until": 1,
        },
    },
    "refine": {
        "summary": "A study that finds the friction coefficient at which the mechanism jams",
        "value": {"scene": "double_pendulum", "refine": {"bounds": {"joints.guide.friction.mu": [0.05, 0.9]}}, "until": 1},
    },
    "indices": {
        "summary": "A Saltelli sample that shows which parameters matter; /indices returns the Sobol indices",
        "value": {
            "scene": "double_pendulum",
            "sample": {
                "ranges": {
                    "joints.guide.friction.mu": "normal(0.1, 0.02)",
                    "joints.guide.friction.half_length": "triangular(0.29, 0.3, 0.31)",
                    "joints.guide.friction.radius": ["49 mm", "51 mm"],
                },
                "count": 64,
                "method": "saltelli",
            },
            "reductions": ["final:guide.q[1]"],
            "until": 1,
        },
    },
    "fit": {
        "summary": "A fit to a measured swing; /answer returns the fitted parameters with confidence intervals",
        "value": {
            "scene": "simple_pendulum",
            "fit": {
                "parameters": ["bodies.bob.center[1]"],
                "runs": [
                    {
                        "time": [0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7],
                        "curves": {"pivot.q[1]": [0.003, 0.057, 0.199, 0.426, 0.778, 1.173, 1.601, 2.046]},
                    }
                ],
                "bounds": {"bodies.bob.center[1]": ["-1.5 m", "-0.5 m"]},
                "trials": {"for longer": {"until": "2 s"}},
            },
        },
    },
}
