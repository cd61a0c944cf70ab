"""A compliant, regularised model in absolute coordinates whose limit is the rigid mechanism with Coulomb's friction.

It takes a scene with all its devices and shares nothing with the engine. ``judged(scene, until, outputs)`` runs the model at
several levels of stiffness and of the speed below which friction rests, and extrapolates. The error is the difference of the last
two extrapolations."""

from tests.reference.compliant.friction_laws import NotJudged
from tests.reference.compliant.runs_and_limit import Judged, judged

__all__ = ["Judged", "NotJudged", "judged"]
