"""Parameters and settings of each case as rows for the C loop."""
