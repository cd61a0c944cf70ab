"""The programs and tables of a scene, assembled to its kernel."""
