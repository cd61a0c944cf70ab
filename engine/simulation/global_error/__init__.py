"""The global error of a run, estimated from a second, tighter run (theory, "Global error")."""
