"""The files of an FMU that describe its contents."""
