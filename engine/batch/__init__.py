"""Many runs of one scene: which cases, their numbers, the C loop that runs them, a table of their reductions."""
