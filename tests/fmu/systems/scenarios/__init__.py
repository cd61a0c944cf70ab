"""Uses of FMUs with fmpy, as scripts. For example: ``python -m tests.fmu.systems.scenarios.parameter_study``."""
