"""A force of 2 kN, an input of the FMU, hits the slider of the crank-slider at 0.2 s. The script prints the forces on the pin."""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np
from fmpy import simulate_fmu

import trunnion
from trunnion.fmu.scene_export import export
from trunnion.scene import scene_from_dict, scene_to_dict

WANTED = ["guide.q[1]", "slider_pin.contact[1].normal_force", "slider_pin.friction.torque[1]", "crank_pivot.drive.effort[1]"]
HIT = 0.2


def scene() -> trunnion.Scene:
    """Example 8.2 with an external force along the guide on the slider."""
    data = scene_to_dict(trunnion.load_scene("crank_slider"))
    data["name"] = "pushed_slider"
    data["inputs"] = {"push": {"unit": "N", "description": "force on the slider along the guide"}}
    data["forces"] = {"pusher": {"type": "force", "on": "slider", "force": [{"input": "push"}, 0, 0]}}
    return scene_from_dict(data)


def run(folder: Path) -> tuple[np.ndarray, np.ndarray]:
    """Columns (time and WANTED) without and with the force."""
    file = folder / "pushed_slider.fmu"
    export(scene(), file)
    push = np.array([(0.0, 0.0), (HIT, 0.0), (HIT, 2000.0), (1.0, 2000.0)], dtype=[("time", float), ("push", float)])
    common = {"stop_time": 0.4, "step_size": 0.001, "output_interval": 0.001, "output": WANTED}
    return simulate_fmu(str(file), **common), simulate_fmu(str(file), input=push, **common)


def main() -> None:
    """Print the forces just before and after the hit."""
    with tempfile.TemporaryDirectory() as folder:
        calm, hit = run(Path(folder))
    for name in WANTED[1:]:
        i = int(np.searchsorted(hit["time"], HIT + 0.0015))
        print(f"{name:40s} without {calm[name][i]:10.2f}   with {hit[name][i]:10.2f}")


if __name__ == "__main__":
    main()
