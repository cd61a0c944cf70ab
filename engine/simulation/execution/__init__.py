"""Runnable models, the loop of a run, and diagnosis of failures."""
