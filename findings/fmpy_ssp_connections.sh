#!/usr/bin/env bash
# The SSP simulation of FMPy 0.3.32 (`simulate_ssp`) copies values along connections as they are: it applies neither the
# LinearTransformation of a connection nor the ParameterBindings of the system. Values of an SSV file count only if the caller hands
# them over, by parameter_set. In the first step, connected inputs are 0, whatever start value the FMU declares.
# Whoever needs factors or start values in FMPy puts them into the FMUs.
# Seen: 0.3.32 on Linux x86-64: factor 10 of a connection and gain 5 of an SSV file do nothing; the first input is 0, not 7.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv venv
venv/bin/pip install -q "fmpy==0.3.32" "pythonfmu==0.7.0"
cat > gain.py <<'PY'
from pythonfmu import Fmi2Causality, Fmi2Slave, Fmi2Variability, Real


class Gain(Fmi2Slave):
    def __init__(self, **given):
        super().__init__(**given)
        self.u, self.y, self.gain = 7.0, 0.0, 1.0
        self.register_variable(Real("u", causality=Fmi2Causality.input, start=7.0))
        self.register_variable(Real("y", causality=Fmi2Causality.output))
        self.register_variable(Real("gain", causality=Fmi2Causality.parameter, variability=Fmi2Variability.tunable, start=1.0))

    def do_step(self, time, step):
        self.y = self.gain * self.u + 1.0
        return True
PY
venv/bin/pythonfmu build -f gain.py > /dev/null
venv/bin/python - <<'PY'
import zipfile

from fmpy.ssp.simulation import simulate_ssp
from fmpy.ssp.ssd import read_ssv

SSP = "http://ssp-standard.org/SSP1/SystemStructure"
head = f'xmlns:ssd="{SSP}Description" xmlns:ssv="{SSP}ParameterValues" xmlns:ssc="{SSP}Common" version="1.0"'
port = lambda name, kind: f'<ssd:Connector name="{name}" kind="{kind}"><ssc:Real/></ssd:Connector>'
part = lambda name: (f'<ssd:Component name="{name}" type="application/x-fmu-sharedlibrary" source="resources/Gain.fmu"><ssd:Connectors>'
                     f'{port("u", "input")}{port("y", "output")}</ssd:Connectors></ssd:Component>')
values = f'<ssv:ParameterSet {head} name="v"><ssv:Parameters><ssv:Parameter name="b.gain"><ssv:Real value="5"/></ssv:Parameter></ssv:Parameters></ssv:ParameterSet>'
system = (f'<ssd:SystemStructureDescription {head} name="s"><ssd:System name="s"><ssd:ParameterBindings><ssd:ParameterBinding '
          f'source="resources/v.ssv"/></ssd:ParameterBindings><ssd:Elements>{part("a")}{part("b")}</ssd:Elements><ssd:Connections>'
          '<ssd:Connection startElement="a" startConnector="y" endElement="b" endConnector="u"><ssc:LinearTransformation factor="10"/>'
          '</ssd:Connection></ssd:Connections></ssd:System></ssd:SystemStructureDescription>')
with zipfile.ZipFile("s.ssp", "w") as z:
    z.writestr("SystemStructure.ssd", system)
    z.writestr("resources/v.ssv", values)
    z.write("Gain.fmu", "resources/Gain.fmu")
zipfile.ZipFile("s.ssp").extract("resources/v.ssv")
plain = simulate_ssp("s.ssp", stop_time=1.5, step_size=1.0)
given = simulate_ssp("s.ssp", stop_time=1.5, step_size=1.0, parameter_set=read_ssv("resources/v.ssv"))
a, b, b5 = list(plain["a.y"]), list(plain["b.y"]), list(given["b.y"])
print(f"a = u + 1 with u never connected: {a}; b = gain (10 a) + 1: {b}, with the values handed over: {b5}")
assert a[0] == 1.0, "the first input is no longer 0"
assert b == [1.0, 2.0], "factor, gain or order are now applied"
assert b5 == [1.0, 6.0], "values that are handed over no longer count"
PY
