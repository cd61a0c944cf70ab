"""FMUs for the tests, exported once in each process: bundled models with any friction law, and a robot arm with inputs."""

from __future__ import annotations

import atexit
import shutil
import tempfile
from functools import cache
from pathlib import Path

import trunnion
from trunnion.fmu.scene_export import export
from trunnion.scene import scene_from_dict
from trunnion.scene.overrides import apply

FOLDER = Path(tempfile.mkdtemp(prefix="trunnion-fmu-tests-"))
atexit.register(shutil.rmtree, FOLDER, ignore_errors=True)
LAWS: dict[str, dict[str, object]] = {
    "": {},
    "lugre": {"friction.law": "lugre", "joints.ball.friction.bristle_stiffness": 1e3, "joints.ball.friction.bristle_damping": 0.03},
    "stribeck": {"friction.law": "stribeck", "joints.ball.friction.mu_static": 0.8, "joints.ball.friction.v_stribeck": 0.01},
    "regularized": {"friction.law": "regularized"},
}


@cache
def exported(model: str, flavour: str = "native", fmi: int = 2) -> Path:
    """The FMU of a bundled model or of ``arm``. All columns are outputs. ``model:law`` gives all friction of the model this law."""
    file = FOLDER / f"{model.replace(':', '-')}-{flavour}{fmi}.fmu"
    name, _, law = model.partition(":")
    if model == "arm":
        export(arm(), file, flavour=flavour, outputs="*", fmi=fmi)
    else:
        export(apply(trunnion.load_scene(name), LAWS[law]), file, flavour=flavour, fmi=fmi)
    return file


def arm() -> trunnion.Scene:
    """Two links. The first link follows an input angle. A torque input acts in the joint of the second link, which has friction."""
    bar = {"box": [0.6, 0.04, 0.04], "density": 7800, "points": {"a": [-0.3, 0, 0], "b": [0.3, 0, 0]}}
    rub = {"mu": 0.1, "radius": 0.01, "half_length": 0.02}
    return scene_from_dict({
        "name": "arm", "gravity": [0, -9.81, 0], "bodies": {"one": bar, "two": bar},
        "inputs": {"motor": {"start": 0.5, "unit": "N*m"}, "angle": {"start": 0.2, "unit": "rad", "bandwidth": 50}},
        "joints": {
            "hip": {"type": "revolute", "axis": "z", "inboard": "ground", "outboard": "one.a", "drive": {"input": "angle"}},
            "knee": {"type": "revolute", "axis": "z", "inboard": "one.b", "outboard": "two.a", "friction": rub,
                     "effort": {"input": "motor"}},
        },
        "simulation": {"until": 1, "every": 0.01},
    })  # fmt: skip
