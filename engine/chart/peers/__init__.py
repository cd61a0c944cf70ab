"""Other programs on the same scene, in the same run, when they are installed; each says what it leaves out."""

from engine.chart.peers.run import measure_peers

__all__ = ["measure_peers"]
