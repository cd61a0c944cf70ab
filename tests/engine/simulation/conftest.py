"""A fixture: the run of the pendulum from which pictures are drawn."""

from tests.plots.conftest import pendulum

__all__ = ["pendulum"]
