#!/usr/bin/env bash
# cofmupy 1.0.0 and pathsim-fmi 0.1.1 read every output of an FMI 3.0 FMU by fmi3GetFloat64, whatever its type. An FMU that has an
# output of type Int32 beside one of type Float64 refuses the call, as the standard wants, and the run ends there. With FMI 2.0 they
# read all outputs by fmi2GetReal.
# Whoever exports FMI 3.0 for these tools selects outputs of type Float64 only.
# Seen: both on Linux x86-64: the FMU with the Float64 output alone runs, that with both ends with an exception.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
for tool in cofmupy pathsim; do python3 -m venv "$tool"; done
cofmupy/bin/pip install -q "cofmupy==1.0.0" "pythonfmu3==0.3.4"
pathsim/bin/pip install -q "pathsim-fmi==0.1.1" "pathsim==0.27.1" "fmpy==0.3.32" "pythonfmu3==0.3.4"
for whole in No With; do cat > "$whole.py" <<PY
from pythonfmu3 import Fmi3Causality, Fmi3Slave, Float64, Int32, ModelExchange


class $whole(Fmi3Slave):
    def __init__(self, **given):
        super().__init__(**given)
        self.time, self.y, self.n = 0.0, 3.0, 4
        self.register_variable(Float64("time", causality=Fmi3Causality.independent))
        self.register_variable(Float64("y", causality=Fmi3Causality.output))
        if "$whole" == "With":
            self.register_variable(Int32("n", causality=Fmi3Causality.output))

    def do_step(self, time, step):
        return True
PY
sed -i 's/, ModelExchange//' "$whole.py"
cofmupy/bin/pythonfmu3 build -f "$whole.py" > /dev/null
done
cat > run.py <<'PY'
import json
import os
import sys

tool, name = sys.argv[1:]
if tool == "cofmupy":
    from cofmupy import Coordinator

    fmus = [{"id": "one", "path": f"{name}.fmu", "name": "one"}]
    json.dump({"fmus": fmus, "connections": [], "cosim_method": "jacobi"}, open("c.json", "w"))
    run = Coordinator()
    run.start("c.json")
    run.do_step(step_size=0.1)
else:
    from pathsim_fmi import CoSimulationFMU
    from pathsim import Simulation

    Simulation([CoSimulationFMU(f"{name}.fmu", dt=0.1)], [], dt=0.1, log=False).run(0.3)
os._exit(0)
PY
for tool in cofmupy pathsim; do
  "$tool/bin/python" -W ignore run.py "$tool" No > no.txt 2>&1 || { tail -3 no.txt; echo "$tool: outputs of type Float64 no longer run"; exit 1; }
  if "$tool/bin/python" -W ignore run.py "$tool" With > with.txt 2>&1; then echo "$tool: an output of type Int32 is now read"; exit 1; fi
  tail -1 with.txt
  grep -q "GetFloat64" with.txt
done
