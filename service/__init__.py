"""Trunnion as a service: batches over REST, kept in a database, run on Dask, with a web page. Start it with ``trunnion serve``."""
