"""Output of commands: summaries, reports, progress, exit codes."""
