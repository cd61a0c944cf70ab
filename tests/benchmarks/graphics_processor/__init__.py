"""A prototype of ensembles on a graphics processor. It builds the C library of a mechanism for the processor, checks the results
and measures the time."""
