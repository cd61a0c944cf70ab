"""Execution of jobs: chunks of cases on Dask workers, their Parquet parts, and the dispatcher that sends the chunks."""
