"""The commands ``serve`` and ``jobs …``, one command in each file."""
