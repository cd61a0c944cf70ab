"""Trunnion as a service: batches over REST, stored in a database, run on Dask, with a web page. Start it with ``trunnion
serve``."""
