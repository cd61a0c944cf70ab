"""Runnable models, the loop of one run, and diagnosis of failures."""
