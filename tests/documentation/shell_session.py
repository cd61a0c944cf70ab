"""A simulated reader, who types the blocks of a page into a shell and into Python. The environment contains exactly the packages
that the page installs."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import time
import urllib.error
import urllib.request
from typing import Any

from tests.documentation.code_blocks import Step
from tests.documentation.virtual_environments import Home

LISTENER = """
import json, sys, traceback
names = {"__name__": "__main__"}
for line in sys.stdin:
    place, text = json.loads(line)
    try:
        exec(compile(text, place, "exec"), names)
        said = ""
    except BaseException:
        said = traceback.format_exc()
    print("\\nRAN " + json.dumps(said), flush=True)
"""
PRINTED_PORT = "8765"
THE_PROJECT = re.compile(r"(pip install (?:-q )?['\"]?)\.(?=[\['\"\s]|$)")
"""The part of a line that names the checkout's project: ``.`` or ``.[extra]``."""
FAILS = {"@db/": "the database cannot be used", "half_length=0.15": "jammed"}
"""Printed lines that end with exit code 1, and their messages: a host that is only an example; a guide that must jam."""
JOB = re.compile(r"\b[0-9a-f]{24}\b")
PATIENCE = 240.0
"""Time limit, s, for the installation and start of a server; only a failing test waits so long."""


class Reader:
    """A reader in one copy of the checkout, whose ``.venv`` grows with each installation. Use the object as a context manager for
    one page."""

    def __init__(self, place: Home):
        self.place, self.home, self.job, self.active = place, place.path, "", False
        self.servers: list[subprocess.Popen[str]] = []
        self.python: subprocess.Popen[str] | None = None

    def __enter__(self) -> Reader:
        return self

    def __exit__(self, *error: object) -> None:
        self._end_servers()
        if self.python is not None:
            assert self.python.stdin is not None
            self.python.stdin.close()
            self.python.wait(60)

    def _end_servers(self) -> None:
        """End the page's servers with Ctrl-C before the page ends or starts another server."""
        while self.servers:
            server = self.servers.pop()
            os.killpg(server.pid, signal.SIGTERM)
            server.wait(60)

    def does(self, step: Step, page: str) -> None:
        """Do the work of one block of the page."""
        place = f"{page}:{step.line}"
        if step.kind == "python":
            self._execute(step.text, place)
        elif step.kind == "yaml":
            (self.home / "page.yaml").write_text(step.text, encoding="utf-8")
            self._type(".venv/bin/trunnion check page.yaml", place)
        elif step.kind == "bash":
            for line in step.text.splitlines():
                self._type(line.partition("  # ")[0].replace("JOB", self.job or "JOB").strip(), place)

    @property
    def environment(self) -> dict[str, str]:
        """Environment variables for the page's programs. No variable points to packages of the tests' own environment."""
        left = {k: v for k, v in os.environ.items() if not k.startswith(("PYTHON", "VIRTUAL_ENV", "PYTEST", "COV_"))}
        scripts = [str(self.home / ".venv" / "bin")] if self.active else []
        ours = {"PIP_DISABLE_PIP_VERSION_CHECK": "1", "MPLBACKEND": "agg", "TRUNNION_CACHE": str(self.place.shared / "cache")}
        if self.place.copied:
            ours["PIP_COMPILE"] = "0"  # Python then compiles only imported modules; pip would compile all modules
        return left | ours | {"PATH": os.pathsep.join([*scripts, left["PATH"]])}

    def _type(self, line: str, place: str) -> None:
        """Type a line into the shell. A server that the line starts runs until the page ends."""
        if not line or line.endswith("-m pytest"):
            return  # the tests that the page asks its reader to run are not run
        if "activate" in line:
            line, self.active = line.replace(". .venv/bin/activate && ", "").replace(" && pip ", " && .venv/bin/pip "), True
        if line in self.place.typed and "&&" not in line.partition("pip install")[2]:
            return  # the environment already has this installation, typed on another page of the group
        if "-m venv" in line:
            self.place.begin(line)
        printed, line = line, self.cheaper(line)
        if re.search(r"trunnion serve\b(?!.*--database)", line):
            self._serve(line.rstrip("& "), place, printed)
        else:
            if "trunnion serve" in line:
                self._end_servers()
            done = subprocess.run(["bash", "-c", line], cwd=self.home, env=self.environment, capture_output=True, text=True)
            told = f"{place}: {line}\n{done.stdout[-2000:]}{done.stderr[-4000:]}"
            wrong = next((text for mark, text in FAILS.items() if mark in line), "")
            assert done.returncode == (1 if wrong else 0), told
            assert wrong in done.stdout + done.stderr, told
            if "pip install" in line:
                self.place.typed_now(printed)
            self.job = (JOB.findall(done.stdout) or [self.job])[0]
            if "/v1/jobs" in line and '"id"' in done.stdout:
                self._ended(json.loads(done.stdout)["id"])

    def cheaper(self, line: str) -> str:
        """The line to run. If the environment already contains the project, built from the same files, the new line installs only
        the extras. The first environment of a session is installed as printed; with TRUNNION_PAGES=all, every environment is."""
        there = self.place.copied or self.place.typed
        return THE_PROJECT.sub(r"\1trunnion", line) if there and os.environ.get("TRUNNION_PAGES") != "all" else line

    def _serve(self, line: str, place: str, printed: str) -> None:
        self._end_servers()
        log = (self.home / "serve.log").open("w+")
        words = ["bash", "-c", line.replace("&& ", "&& exec ", 1) if "&&" in line else f"exec {line}"]
        where = {"cwd": self.home, "env": self.environment, "stdout": log, "stderr": log}
        server = subprocess.Popen(words, text=True, start_new_session=True, **where)  # type: ignore[call-overload]
        self.servers.append(server)
        end = time.monotonic() + PATIENCE
        while not asked("/healthz"):
            log.seek(0)
            assert server.poll() is None, f"{place}: {line} ended: {log.read()[-4000:]}"
            assert time.monotonic() < end, f"{place}: {line} does not answer: {log.read()[-4000:]}"
            time.sleep(0.2)
        if "pip install" in line:
            self.place.typed_now(printed)

    def _ended(self, job: str) -> None:
        """Wait for a job, as its submitter would wait before fetching results."""
        end = time.monotonic() + PATIENCE
        while (asked(f"/v1/jobs/{job}") or {}).get("state") not in ("done", "failed", "cancelled"):
            assert time.monotonic() < end, "the job did not end"
            time.sleep(0.2)

    def _execute(self, text: str, place: str) -> None:
        """Run a block in the page's Python, which keeps its names from block to block."""
        if self.python is None:
            words = [str(self.home / ".venv" / "bin" / "python"), "-c", LISTENER]
            self.python = subprocess.Popen(
                words, cwd=self.home, env=self.environment, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
            )
        assert self.python.stdin is not None
        assert self.python.stdout is not None
        print(json.dumps([place, text]), file=self.python.stdin, flush=True)
        said = next(x for x in self.python.stdout if x.startswith("RAN "))
        assert json.loads(said[4:]) == "", json.loads(said[4:])


def asked(path: str) -> Any:
    """The answer of the server at the printed address; None if no server answers."""
    try:
        with urllib.request.urlopen(f"http://127.0.0.1:{PRINTED_PORT}{path}", timeout=10) as answer:
            return json.loads(answer.read())
    except (urllib.error.URLError, OSError):
        return None
