"""A fixture: the run of the pendulum that pictures show."""

from tests.plots.conftest import pendulum

__all__ = ["pendulum"]
