"""The project's rules: style, types, order of layers, commands in the README, and registries that agree with each other."""

from __future__ import annotations

import ast
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.conventions.parsed_sources import syntax_of
from trunnion.cli.command_registry import COMMANDS
from trunnion.elements import contact, joints
from trunnion.elements.joints.joint_kind import JointKind
from trunnion.packaging.setuptools_commands import PACKAGES

ROOT = Path(__file__).resolve().parents[2]
CHECKS = {
    "mypy": ["-m", "mypy", "--cache-dir", str(ROOT / ".mypy_cache")],
    "import-linter": ["-c", "from importlinter.cli import lint_imports_command as f; f()"],
}
"""Tools that read the package ``trunnion`` by its path."""
RUBBING = sorted((k for k in joints.REGISTRY.values() if k.friction), key=lambda k: k.name)


@pytest.fixture(scope="module")
def as_installed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the package in the layout of a wheel. The type checkers do not follow the import finder of an editable
    installation."""
    place = tmp_path_factory.mktemp("installed")
    for name, folder in PACKAGES.items():
        shutil.copytree(ROOT / folder, place / name.replace(".", "/"), ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copy(ROOT / "pyproject.toml", place)
    return place


def finds_nothing(folder: Path, *words: str) -> None:
    env = {**os.environ, "PYTHONPATH": str(folder), "MYPYPATH": str(folder)}
    done = subprocess.run([sys.executable, *words], cwd=folder, env=env, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr


@pytest.mark.parametrize("check", CHECKS)
def test_static_checks_find_nothing(check: str, as_installed: Path) -> None:
    finds_nothing(as_installed, *CHECKS[check])


def test_a_users_type_checker_sees_the_public_names(as_installed: Path, tmp_path: Path) -> None:
    """The public names load lazily. Nevertheless, mypy knows their types and reports a name that does not exist."""
    (tmp_path / "script.py").write_text(
        "import trunnion\nx: int = trunnion.simulate('spherical_pendulum')\ny: trunnion.Result\ntrunnion.simulat()\n"
    )
    env = {**os.environ, "MYPYPATH": str(as_installed)}
    words = [*CHECKS["mypy"], "--config-file", str(as_installed / "pyproject.toml"), str(tmp_path / "script.py")]
    done = subprocess.run([sys.executable, *words], cwd=tmp_path, env=env, capture_output=True, text=True)
    errors = re.findall(r"script.py:(\d+): error: .*\[([\w-]+)\]", done.stdout)
    assert errors == [("2", "assignment"), ("4", "attr-defined")], done.stdout + done.stderr


def test_ruff_finds_nothing() -> None:
    finds_nothing(ROOT, "-m", "ruff", "check", ".")


def test_the_top_level_is_fixed() -> None:
    """The top level holds only these files. Output files of the pages' commands must not be committed."""
    told = subprocess.run(["git", "ls-files"], cwd=ROOT, capture_output=True, text=True, check=False)
    if told.returncode:
        pytest.skip("no git checkout")
    top = {f.partition("/")[0] for f in told.stdout.splitlines()}
    shown = {name for name in top if not name.startswith(".")}
    files = {"pyproject.toml", "README.md", "CHANGELOG.md", "CONTRIBUTING.md", "LICENSE"}
    assert shown - {"findings"} == {"engine", "fmu", "service", "tests", "models"} | files


# -- README ---------------------------------------------------------------------------------------------------------------------


def blocks(kind: str) -> list[list[str]]:
    """Fenced code blocks of the README of one kind, as lines."""
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    return [b.strip().splitlines() for b in re.findall(rf"^```{kind}\n(.*?)^```", text, re.MULTILINE | re.DOTALL)]


def test_the_first_code_block_is_one_line_to_run_and_one_to_test() -> None:
    first = re.search(r"^```.*?^```", (ROOT / "README.md").read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL)
    assert first is not None
    run, test = first.group().splitlines()[1:-1]
    assert all(line.startswith("python3 -m venv .venv && .venv/bin/pip install ") for line in (run, test))
    assert " trunnion simulate spherical_pendulum " in run.replace(".venv/bin/", " ")
    assert test.endswith("python -m pytest")


def test_ci_runs_the_readmes_test_command() -> None:
    """CI extracts the command from the README by a pattern, so the command must match. CI waits for its tools before the last part
    of the command."""
    script = (ROOT / ".ci" / "run").read_text(encoding="utf-8")
    pick = re.search(r"command=\$\((.*)\)$", script, re.MULTILINE)
    assert pick is not None
    got = subprocess.run(["bash", "-c", pick.group(1)], cwd=ROOT, capture_output=True, text=True).stdout.strip()
    assert got == blocks("bash")[0][1]
    halves = re.findall(r'^eval "(\$\{command.*)"$', script, re.MULTILINE)
    joined = f"command='{got}'; echo \"{' && '.join(halves)}\""
    assert subprocess.run(["bash", "-c", joined], capture_output=True, text=True).stdout.strip() == got


def test_the_lines_for_windows_are_those_for_other_systems() -> None:
    def plain(line: str) -> str:
        return line.replace("\\Scripts\\", "/bin/").replace("py -m", "python3 -m")

    assert [plain(x) for x in blocks("bat")[0]] == blocks("bash")[0]


def test_every_command_the_readme_names_exists() -> None:
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    named = set(re.findall(r"(?:`|/bin/)trunnion ([a-z]+)", text))
    known = {name.split()[0] for name in COMMANDS}
    assert {"new", "check", "simulate", "models"} <= named
    assert named <= known


def test_every_script_named_in_the_documents_exists() -> None:
    for file in ("README.md", "CONTRIBUTING.md", "engine/README.md", "tests/benchmarks/README.md"):
        for module in re.findall(r"python -m (tests[\w.]+)", (ROOT / file).read_text(encoding="utf-8")):
            assert (ROOT / (module.replace(".", "/") + ".py")).is_file(), f"{file}: {module}"


NOTATION = "engine/docs/reference/notation.md"
THEORY = sorted(f.relative_to(ROOT).as_posix() for f in (ROOT / "engine" / "docs" / "theory").glob("*.md"))
DOCUMENTS = [
    "README.md",
    "CONTRIBUTING.md",
    *(f"engine/{n}.md" for n in ("README", "runtime/README", "docs/reference/notation")),
    *THEORY,
]


@pytest.mark.parametrize("file", DOCUMENTS)
def test_every_link_leads_somewhere(file: str) -> None:
    links = re.findall(r"\]\(([^)\s#]+)\)", (ROOT / file).read_text(encoding="utf-8"))
    assert not [x for x in links if not re.match(r"[a-z]+:", x) and not ((ROOT / file).parent / x).exists()]


def test_every_module_opens_with_a_sentence() -> None:
    for file in (ROOT / "engine").rglob("*.py"):
        text = file.read_text(encoding="utf-8")
        assert re.match(r'r?"""[^"\s]', text) or not text, f"{file.relative_to(ROOT)} has no sentence at its top"


# -- Notation and method ---------------------------------------------------------------------------------------------------------

CITING = ("engine", "fmu", "service", "tests", "models")
WORDS = (".py", ".c", ".h", ".md", ".yaml")


def text_of(file: str) -> str:
    return (ROOT / file).read_text(encoding="utf-8")


def plain(title: str) -> str:
    """A heading, or the citation of a heading, as one line."""
    return " ".join(title.replace("\n", " ").replace("#", " ").replace(" * ", " ").split())


def headings(file: str) -> list[str]:
    return [h.strip() for h in re.findall(r"^#+ (.*)$", text_of(file), re.MULTILINE)]


def cited() -> dict[Path, str]:
    """Every file that may cite a document."""
    files = [f for folder in CITING for f in (ROOT / folder).rglob("*") if f.suffix in WORDS and "__pycache__" not in f.parts]
    return {f.relative_to(ROOT): f.read_text(encoding="utf-8") for f in [*files, ROOT / "CONTRIBUTING.md", ROOT / "CHANGELOG.md"]}


def identifiers(file: str) -> set[str]:
    """All names in a file of the engine; comments are left out."""
    text = text_of(f"engine/{file}")
    if not file.endswith(".py"):
        return set(re.findall(r"\w+", re.sub(r"/\*.*?\*/", "", text, flags=re.DOTALL)))
    names: set[str] = set()
    for node in ast.walk(ast.parse(text)):
        for field in ("id", "attr", "arg", "name"):
            names |= {v} if isinstance(v := getattr(node, field, None), str) else set()
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and node.value.isidentifier():
            names.add(node.value)
    return names


def symbols() -> list[tuple[str, str]]:
    """(name in code, its file) for every row of the tables of symbols in NOTATION."""
    part = text_of(NOTATION).split("## Symbols")[1].split("\n## ")[0]
    out = []
    for line in part.splitlines():
        file = re.search(r"\| `([\w/]+\.\w+)` \|", line)
        if file:
            out += [(name, file.group(1)) for name in re.findall(r"`([A-Za-z]\w*)`", line[: file.start()])]
    return out


def test_every_name_of_the_notation_is_one_in_the_file_it_names() -> None:
    table = symbols()
    assert {"Gamma", "Pi", "M11", "F", "y", "N", "S", "Se", "lam", "eta", "kr"} <= {name for name, _ in table}
    assert not [(name, file) for name, file in table if name not in identifiers(file)]


def test_every_section_that_is_cited_exists() -> None:
    theory = [h for page in THEORY for h in headings(page)]
    known = {"notation": headings(NOTATION), "theory": theory}
    found = [
        (file, name, plain(title))
        for file, text in cited().items()
        for name, titles in re.findall(r'\b(theory|notation)(?:\.md)?[\s(,*#]+((?:"[^"]+"(?:, (?="))?)+)', text)
        for title in re.findall(r'"([^"]+)"', titles)
    ]
    assert len(found) > 20
    assert not [f for f in found if f[2] not in known[f[1]]]


def test_every_link_to_a_section_leads_there() -> None:
    known = {page: {re.sub(r"[^\w -]", "", h).lower().replace(" ", "-") for h in headings(page)} for page in THEORY}
    links = [
        (page, target, section) for page in THEORY for target, section in re.findall(r"\]\((\w*(?:\.md)?)#([^)]+)\)", text_of(page))
    ]
    assert len(links) > 50
    folder = "engine/docs/theory/"
    assert not [x for x in links if x[2] not in known[folder + x[1] if x[1] else x[0]]]


def test_nothing_cites_a_document_that_the_project_does_not_hold() -> None:
    elsewhere = re.compile(r"(method|design)( notes?|\.md)? §|\b(method|design|stick|benchmarks)\.md|\bbenchmark list")
    here = Path(__file__).relative_to(ROOT)
    assert not [(f, m.group()) for f, text in cited().items() if f != here for m in elsewhere.finditer(text)]


def test_every_section_of_the_theory_names_its_tests() -> None:
    sections = [s for page in THEORY for s in re.split(r"^##+ ", text_of(page), flags=re.MULTILINE)[1:]]
    assert len(sections) > 25
    assert not [x.splitlines()[0] for x in sections if "*Tests*:" not in x]


def test_every_file_and_name_of_the_method_exists() -> None:
    text = "\n\n".join(map(text_of, THEORY))
    for paragraph in re.split(r"\n\n", text):
        for kind, root in (("*Code*", "engine"), ("*Tests*", "tests")):
            part = paragraph.partition(kind + ":")[2].partition("*Tests*:" if kind == "*Code*" else "\0")[0]
            for file in re.findall(r"`([a-z_]+/[\w/]+\.\w+)`", part):
                assert (ROOT / root / file).exists(), f"theory: {root}/{file}"
    code = [t for f, t in cited().items() if f.parts[0] == "engine" and f.suffix in (".c", ".h", ".py")]
    words = {word for text in code for word in re.findall(r"\w+", text)}
    named = re.findall(r"`([A-Z]+(?:_[A-Z]+)*|tr_\w+)`", text)
    assert len(named) > 20
    assert not set(named) - words


# -- Registries -----------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", RUBBING, ids=lambda k: k.name)
def test_a_joint_type_has_as_many_contacts_as_its_contact_element(kind: JointKind) -> None:
    assert kind.contacts == contact.REGISTRY[kind.friction].count


def test_every_contact_element_belongs_to_a_joint_type_and_the_other_way_round() -> None:
    given = {contact.element_of("", k.freely_rubbed, contact.GIVEN) for k in RUBBING} - {""}
    given |= {name for k in RUBBING for name in (k.loaded, k.banded)} - {""}
    assert {k.friction for k in RUBBING} | given == set(contact.REGISTRY)
    assert all(k.contacts == 0 for k in joints.REGISTRY.values() if not k.friction)


TYPES_BY_NAME = {
    "engine/importers/urdf.py": "translates the words of another format",
    "engine/importers/freecad_asmt.py": "translates the words of another format",
    "engine/importers/mjcf/joints.py": "translates the words of another format",
    "engine/importers/sdf/joints.py": "translates the words of another format",
    "engine/importers/sdf/scene_builder.py": "translates the words of another format",
    "engine/analysis/work_precision/reference_solvers/pinocchio.py": "says what another program has",
    "engine/analysis/work_precision/reference_solvers/mujoco.py": "says what another program has",
    "engine/analysis/work_precision/reference_solvers/exudyn.py": "says what another program has",
}
"""Files outside engine/joints that name a joint type, and the reason."""
COMMON_WORDS = {"fixed", "free", "rod"}
"""Types whose names are also other words (a fixed step, an FMI variability, a body)."""


def test_nothing_outside_its_folder_asks_for_a_joint_type_by_name() -> None:
    names = set(joints.REGISTRY) - COMMON_WORDS
    named, found = re.compile("|".join(names)), set()
    for top in ("engine", "fmu", "service"):
        for file in (ROOT / top).rglob("*.py"):
            where = file.relative_to(ROOT).as_posix()
            text = file.read_text(encoding="utf-8")
            strings = syntax_of(file).texts if named.search(text) else ()
            if not where.startswith("engine/elements/joints/") and names & set(strings):
                found.add(where)
    assert found <= set(TYPES_BY_NAME)
    assert set(TYPES_BY_NAME) <= found, "some of these are gone: take them off the list"
