"""Results of runs: columns, events, outcome, audit, error statement, and their files."""
