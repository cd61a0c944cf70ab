"""Libraries of an FMU, per platform and flavour."""
