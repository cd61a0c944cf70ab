"""Questions whose next cases follow from the results of the last: the best numbers, and where a result jumps or bends."""
