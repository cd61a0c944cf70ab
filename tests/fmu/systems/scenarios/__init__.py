"""FMUs in use with fmpy, as scripts: ``python -m tests.fmu.systems.scenarios.parameter_study`` and the others."""
