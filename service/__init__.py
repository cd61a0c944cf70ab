"""The simulation server. Clients submit batches by a REST interface or a web page. The server stores the batches in a database and
runs the batches on Dask. The command ``trunnion serve`` starts the server."""
