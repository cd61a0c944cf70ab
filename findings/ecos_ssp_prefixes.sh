#!/usr/bin/env bash
# ecospy 0.7.2 finds the elements of an SSP file by their usual prefixes, not by their namespace. It reads a file with the prefix
# `ssd:`. It refuses an equivalent file with a default namespace, with the message "Unsupported SSP version: ''!". SSP files for
# many readers should therefore use the prefixes ssd, ssv and ssc.
# Seen: 0.7.2 on Linux x86-64 (Debian 12 with libtbb12).
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv venv
venv/bin/pip install -q "ecospy==0.7.2" "pythonfmu==0.7.0"
cat > one.py <<'PY'
from pythonfmu import Fmi2Causality, Fmi2Slave, Real


class One(Fmi2Slave):
    def __init__(self, **given):
        super().__init__(**given)
        self.y = 3.0
        self.register_variable(Real("y", causality=Fmi2Causality.output))

    def do_step(self, time, step):
        return True
PY
venv/bin/pythonfmu build -f one.py > /dev/null
venv/bin/python - <<'PY'
import os
import zipfile

from ecospy import EcosSimulation

SSP = "http://ssp-standard.org/SSP1/SystemStructure"


def run(prefix: str) -> str:
    p, file = (f"{prefix}:", f"{prefix}.ssp") if prefix else ("", "default.ssp")
    space = f'xmlns:{prefix}="{SSP}Description"' if prefix else f'xmlns="{SSP}Description"'
    text = (f'<{p}SystemStructureDescription {space} xmlns:ssc="{SSP}Common" version="1.0" name="s"><{p}System name="s"><{p}Elements>'
            f'<{p}Component name="one" type="application/x-fmu-sharedlibrary" source="resources/One.fmu"><{p}Connectors><{p}Connector '
            f'name="y" kind="output"><ssc:Real/></{p}Connector></{p}Connectors></{p}Component></{p}Elements></{p}System>'
            f'</{p}SystemStructureDescription>')
    with zipfile.ZipFile(file, "w") as z:
        z.writestr("SystemStructure.ssd", text)
        z.write("One.fmu", "resources/One.fmu")
    try:
        with EcosSimulation(step_size=0.1, ssp_path=file) as made:
            made.init()
            made.step()
            return f"y = {made.get_real('one::y')}"
    except Exception as e:
        return str(e)


found = {prefix or "default namespace": run(prefix) for prefix in ("ssd", "")}
print(found, flush=True)
ok = found == {"ssd": "y = 3.0", "default namespace": "Unsupported SSP version: ''!"}
os._exit(0 if ok else 1)
PY
