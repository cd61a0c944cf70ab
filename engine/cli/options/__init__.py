"""Values of options: completion, parsing, settings of runs."""
