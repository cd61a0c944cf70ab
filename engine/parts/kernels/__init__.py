"""Assembly of a scene's programs and tables to its kernel."""
