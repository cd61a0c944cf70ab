"""How far each number of a run can be trusted: its global error, estimated from a second, tighter run (METHOD, "Global error")."""
