"""Analyses of a mechanism beyond a single run: statics, vibrations, derivatives, fits, searches, charts."""
