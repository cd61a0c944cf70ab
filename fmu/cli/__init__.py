"""The commands ``fmu``, ``ssp``, ``export c`` and ``export web``, one command in each file."""
