"""Studies choose their next cases from earlier results: optimisation, and refinement where a result jumps or has a kink."""
