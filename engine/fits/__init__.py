"""What measured curves say of a scene's numbers: estimates with their intervals, what they cannot say, which law, what to measure
next."""

from engine.fits.api import Fit, fit
from engine.fits.evidence import Candidate, Evidence, compare
from engine.fits.experiments import Proposal, Trial, propose
from engine.fits.measured import Measured
from engine.fits.profile import Interval

__all__ = ["Candidate", "Evidence", "Fit", "Interval", "Measured", "Proposal", "Trial", "compare", "fit", "propose"]
