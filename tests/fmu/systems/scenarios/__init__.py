"""FMUs at work in fmpy, as runnable scripts: ``python -m tests.fmu.systems.scenarios.parameter_study`` and the others."""
