"""Requests that several commands make, read from their options."""
