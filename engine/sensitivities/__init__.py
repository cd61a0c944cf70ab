"""Derivatives of outputs by parameters through a run, across events: ``sensitivity``; parameters from measured curves: ``fit``."""

from engine.sensitivities.api import Sensitivity, sensitivity
from engine.sensitivities.fit import Fit, fit

__all__ = ["Fit", "Sensitivity", "fit", "sensitivity"]
