"""Data classes of a system: bodies, joints, devices, loops and the table of parameters."""
