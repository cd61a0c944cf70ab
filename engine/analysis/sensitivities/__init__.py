"""Derivatives of outputs by parameters along a run and across its events."""
