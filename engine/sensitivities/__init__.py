"""Derivatives of outputs by parameters through a run, across events: ``sensitivity``."""

from engine.sensitivities.api import Sensitivity, sensitivity

__all__ = ["Sensitivity", "sensitivity"]
