"""The mechanism without forces: bodies, joints and drives only."""

from __future__ import annotations

from dataclasses import replace

from trunnion.scene.data_classes import scene as sm


def without_forces(scene: sm.Scene) -> sm.Scene:
    """The scene without gravity, loads, friction and devices. Springs and bushings stay in the scene with zero stiffness and
    damping, so that their outputs are available."""
    joints = {
        n: replace(j, friction=None, ends=None, spring=None, damping=None, nonlinear=None, rotor_inertia=None,
                   end_stops=None, effort=None, motor=None, latch=None, wear=None)
        for n, j in scene.joints.items()
    }  # fmt: skip
    forces: dict[str, sm.Applied] = {}
    for n, f in scene.forces.items():
        if isinstance(f, sm.SpringDamper):
            forces[n] = replace(f, stiffness=0.0, damping=0.0, nonlinear=None)
        elif isinstance(f, sm.Bushing):
            forces[n] = replace(f, stiffness=0.0, damping=0.0, turning_stiffness=0.0, turning_damping=0.0)
    return replace(scene, joints=joints, gravity=(0.0, 0.0, 0.0), forces=forces, outputs=("*",))
