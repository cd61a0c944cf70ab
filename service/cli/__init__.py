"""The commands ``serve`` and ``jobs …``, one a file."""
