"""Export of systems of FMUs (SSP)."""
