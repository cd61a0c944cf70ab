"""Variables of an FMU: outputs, inputs, parameters, clocks and states."""
