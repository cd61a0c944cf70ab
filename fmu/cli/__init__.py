"""The commands ``fmu``, ``ssp``, ``export c`` and ``export web``, one a file."""
