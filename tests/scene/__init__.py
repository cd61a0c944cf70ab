"""Tests of scenes: reading, units, checks, models."""
