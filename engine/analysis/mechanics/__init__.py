"""Poses of rest, vibrations, linearisation, kinematics, drive efforts of a given motion, impacts in clearances, and wear."""
