"""Running jobs: chunks on Dask workers, their Parquet parts, and the dispatcher that hands them out."""
