"""The run of the pendulum that pictures are drawn of, as a fixture."""

from tests.plots.conftest import pendulum

__all__ = ["pendulum"]
