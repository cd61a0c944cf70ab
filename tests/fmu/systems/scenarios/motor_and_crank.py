"""A master couples two FMUs. A motor turns the crank of the crank-slider, and the drive torque of the crank loads the motor.

In each step of 1 ms, the motor is first, with the load of the previous step. The crank then follows the motor's angle exactly,
because it receives the angle with two derivatives. The mechanism as one scene (rotor and crank in one body) shows the error of the
coupling. """

from __future__ import annotations

import math
import shutil
import tempfile
from pathlib import Path

from fmpy import extract, read_model_description
from fmpy.fmi2 import FMU2Slave

import trunnion
from trunnion.fmu.scene_export import export
from trunnion.scene import scene_from_dict, scene_to_dict

START, TORQUE, ROTOR, STEP = 0.5, 400.0, 60.0, 1e-3
LOAD = "crank_pivot.drive.effort[1]"


def motor() -> trunnion.Scene:
    """A rotor with two torques: the torque of the field and the torque of the load."""
    return scene_from_dict({
        "name": "motor", "gravity": [0, 0, 0], "bodies": {"rotor": {"mass": 1, "inertia": [ROTOR, ROTOR, ROTOR]}},
        "inputs": {"field": {"start": TORQUE, "unit": "N*m"}, "load": {"unit": "N*m"}},
        "joints": {"shaft": {"type": "revolute", "axis": "z", "inboard": "ground", "outboard": "rotor",
                             "effort": {"input": "field"}, "start": {"q": START, "qd": 0}}},
        "forces": {"coupling": {"type": "torque", "on": "rotor", "torque": [0, 0, {"input": "load"}]}},
    })  # fmt: skip


def crank_slider() -> trunnion.Scene:
    """Example 8.2 with the crank's angle as an input."""
    data = scene_to_dict(trunnion.load_scene("crank_slider"))
    data["inputs"] = {"angle": {"start": START, "unit": "rad"}}
    data["joints"]["crank_pivot"]["drive"] = {"input": "angle"}
    del data["joints"]["slider_pin"]["start"]
    reach = 0.5 * math.cos(START) + math.sqrt(1.0 - (0.5 * math.sin(START)) ** 2)
    data["joints"]["guide"]["start"] = {"q": reach}
    return scene_from_dict(data)


def one_scene() -> trunnion.Scene:
    """The crank-slider with the rotor's inertia on the crank and the field's torque in its pivot."""
    data = scene_to_dict(crank_slider())
    del data["inputs"]
    pivot = data["joints"]["crank_pivot"]
    del pivot["drive"]
    pivot |= {"effort": TORQUE, "start": {"q": START, "qd": 0}}
    mass = 0.5 * 0.1 * 0.1 * 7801
    thin, wide = mass * 0.02 / 12, mass * (0.25 + 0.01) / 12
    data["bodies"]["crank"] |= {"inertia": [thin + ROTOR, wide + ROTOR, wide + ROTOR], "mass": mass}
    data["bodies"]["crank"].pop("density")
    return scene_from_dict(data)


class Part:
    """An FMU in the master."""

    def __init__(self, scene: trunnion.Scene, folder: Path):
        file = folder / f"{scene.name}.fmu"
        export(scene, file)
        md = read_model_description(file)
        self.reference = {v.name: v.valueReference for v in md.modelVariables}
        self.folder = extract(str(file))
        self.fmu = FMU2Slave(guid=md.guid, unzipDirectory=self.folder, instanceName=scene.name,
                             modelIdentifier=md.coSimulation.modelIdentifier)
        self.fmu.instantiate()
        self.fmu.setupExperiment(startTime=0.0)
        self.fmu.enterInitializationMode()
        self.fmu.exitInitializationMode()

    def get(self, *names: str) -> list[float]:
        """Values of variables by name."""
        return self.fmu.getReal([self.reference[n] for n in names])

    def put(self, name: str, value: float, *derivatives: float) -> None:
        """Set an input, with derivatives."""
        at = self.reference[name]
        self.fmu.setReal([at], [value])
        if derivatives:
            self.fmu.setRealInputDerivatives([at] * len(derivatives), list(range(1, len(derivatives) + 1)), list(derivatives))

    def close(self) -> None:
        """End the instance and free it."""
        self.fmu.terminate()
        self.fmu.freeInstance()
        shutil.rmtree(self.folder, ignore_errors=True)


def coupled(folder: Path, until: float, step: float = STEP) -> list[tuple[float, float, float]]:
    """(time, motor angle, crank angle) after every step."""
    drive, load = Part(motor(), folder), Part(crank_slider(), folder)
    out = []
    for k in range(round(until / step)):
        t = k * step
        q, rate = drive.get("shaft.q[1]", "shaft.qd[1]")
        drive.put("load", -load.get(LOAD)[0])
        (acceleration,) = drive.get("shaft.qdd[1]")
        load.put("angle", q, rate, acceleration)
        drive.fmu.doStep(t, step)
        load.fmu.doStep(t, step)
        out.append((t + step, *drive.get("shaft.q[1]"), *load.get("crank_pivot.q[1]")))
    drive.close()
    load.close()
    return out


def main() -> None:
    """Print the angle every tenth of a second, coupled and as one scene."""
    with tempfile.TemporaryDirectory() as folder:
        rows = coupled(Path(folder), 1.0)
    whole = trunnion.simulate(one_scene(), until=1.0, every=STEP)["crank_pivot.q[1]"]
    print("   t     motor     crank     one scene")
    for k in range(99, 1000, 100):
        t, q, crank = rows[k]
        print(f"{t:5.2f} {q:9.5f} {crank:9.5f} {whole[k + 1]:9.5f}")


if __name__ == "__main__":
    main()
