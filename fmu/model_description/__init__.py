"""Description files of an FMU."""
