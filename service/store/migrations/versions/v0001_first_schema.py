"""The first schema: tables of jobs, chunks, attempts, events and keys. A new database gets the present tables at once
(``database_connection.upgrade``). The other migrations change the tables of earlier versions."""

revision = "0001"
down_revision = None
