"""Advice: the cheapest model, method and tolerance that meet a given error."""
