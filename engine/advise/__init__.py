"""The least model, method and tolerance that meet a wanted error, with the evidence: ``advise(scene, error, outputs)``."""

from engine.advise.ladder import Advice, Rung, advise
from engine.advise.reduce import Form

__all__ = ["Advice", "Form", "Rung", "advise"]
