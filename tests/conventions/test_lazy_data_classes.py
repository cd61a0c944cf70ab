"""Data classes that are built at their first use act like data classes of the standard library and of pydantic."""

from __future__ import annotations

import copy
import dataclasses
import pickle
import re
import subprocess
import sys
from abc import ABC, abstractmethod
from concurrent.futures import ThreadPoolExecutor
from dataclasses import field, fields, is_dataclass, replace
from functools import partial
from pathlib import Path
from threading import Thread
from typing import Any

import pytest

from trunnion.basics import lazy_data_classes
from trunnion.basics.lazy_data_classes import METHODS, dataclass, validated

ENGINE = Path(lazy_data_classes.__file__).parents[1]


def family(decorator: Any) -> tuple[type, type, type]:
    """A frozen class, a subclass of it, and a class that is not frozen."""

    @decorator(frozen=True)
    class Rod:
        length: float
        ends: tuple[str, ...] = ("a", "b")
        notes: dict[str, int] = field(default_factory=dict, compare=False)

    @decorator(frozen=True, kw_only=True)
    class Tube(Rod):
        bore: float = 0.5

    @decorator
    class Load:
        size: float = 1.0

    return Rod, Tube, Load


def outcome(work: Any) -> Any:
    """The text of the result of ``work``, or the type and text of its exception."""
    try:
        return re.sub(r"family\.<locals>\.|0x\w+", "", repr(work()))
    except Exception as e:  # noqa: BLE001
        return type(e), str(e).replace("family.<locals>.", "")


USES: dict[str, Any] = {
    "repr": lambda rod, tube, load: (rod(2.0), tube(2.0, bore=1.0), load()),
    "equal": lambda rod, tube, load: (rod(1) == rod(1), rod(1) == rod(2), rod(1) == tube(1), load(2) == load(2), load() != load()),
    "hash": lambda rod, tube, load: hash(rod(1.0)) == hash(rod(1.0)),
    "unhashable": lambda rod, tube, load: hash(load()),
    "frozen": lambda rod, tube, load: setattr(rod(1.0), "length", 2.0),
    "frozen, inherited": lambda rod, tube, load: delattr(tube(1.0), "length"),
    "not frozen": lambda rod, tube, load: setattr(load(), "size", 2.0),
    "missing argument": lambda rod, tube, load: rod(),
    "unknown argument": lambda rod, tube, load: tube(1.0, wall=1),
    "fields of a class": lambda rod, tube, load: [(f.name, f.default) for c in (tube, rod, load) for f in fields(c)][:2],
    "names of fields": lambda rod, tube, load: [f.name for c in (tube, rod, load) for f in fields(c)],
    "is a data class": lambda rod, tube, load: (is_dataclass(rod), is_dataclass(tube(1.0)), rod.__match_args__),
    "replace": lambda rod, tube, load: replace(tube(1.0), length=3.0),
    "copy": lambda rod, tube, load: (copy.copy(rod(1.0)), copy.deepcopy(tube(1.0)) == tube(1.0)),
    "default of a class": lambda rod, tube, load: (rod(0.0).ends, rod.ends, load.size),
    "a factory makes a value for each": lambda rod, tube, load: rod(1.0).notes is rod(1.0).notes,
    "a class without fields of its own": lambda rod, tube, load: type("Plain", (rod,), {})(1.0),
}


@pytest.mark.parametrize("use", USES)
def test_a_class_behaves_as_that_of_the_standard_library(use: str) -> None:
    assert outcome(lambda: USES[use](*family(dataclass))) == outcome(lambda: USES[use](*family(dataclasses.dataclass)))


def test_an_abstract_class_stays_abstract_and_keeps_its_registered_classes() -> None:
    @dataclass(frozen=True)
    class Shape(ABC):
        size: float

        @abstractmethod
        def area(self) -> float:
            """The area."""

    Shape.register(int)
    with pytest.raises(TypeError, match="abstract"):
        Shape(1.0)  # type: ignore[abstract]
    assert [f.name for f in fields(Shape)] == ["size"]
    assert isinstance(3, Shape)


@dataclass(frozen=True)
class Stored:
    """A class of which only pickle makes instances."""

    size: float


def test_an_unpickled_instance_of_a_class_that_is_not_made_behaves_as_one_that_is_built() -> None:
    text = pickle.dumps(Stored(2.0))

    @dataclass(frozen=True)
    class Fresh:
        size: float

    unmade = Fresh.__new__(Fresh)
    unmade.__dict__["size"] = 2.0
    assert isinstance(vars(Fresh)["__dataclass_fields__"], lazy_data_classes._Fact)
    assert unmade == Fresh(2.0)
    assert pickle.loads(text) == Stored(2.0)


def test_a_class_has_the_methods_of_values_only_from_their_first_call() -> None:
    rod, tube, _ = family(dataclass)
    assert tube(1.0).bore == 0.5
    standing = [[m for m in METHODS if hasattr(vars(c).get(m), "_until_made")] for c in (rod, tube)]
    assert standing == [[*lazy_data_classes.OF_VALUES]] * 2
    assert rod(1.0, notes={"a": 1}) == rod(1.0)  # the options of fields count in the methods that are made later
    assert not [m for m in METHODS if hasattr(vars(rod).get(m), "_until_made")]
    assert hash(tube(1.0)) == hash(tube(1.0))


def test_threads_make_a_class_once() -> None:
    for _ in range(20):
        _, tube, _ = family(dataclass)
        with ThreadPoolExecutor(4) as threads:
            assert [*threads.map(tube, [1.0] * 4)] == [tube(1.0)] * 4
        assert all(not hasattr(vars(tube).get(m), "_until_made") for m in METHODS)


@pytest.mark.parametrize("options", [{}, {"config": {}}], ids=["standard library", "pydantic"])
def test_a_thread_may_use_a_class_while_another_makes_it(options: dict[str, Any], monkeypatch: pytest.MonkeyPatch) -> None:
    rod, _, _ = family(partial(dataclass, **options))
    whole, found = lazy_data_classes._decorated, list[Any]()
    other = Thread(target=lambda: found.append(outcome(lambda: rod(2.0))))

    def decorated(cls: type, options: dict[str, Any]) -> Any:
        if not other.ident:
            other.start()
            other.join(0.1)  # by then, the other thread has failed or waits until the class is built
        return whole(cls, options)

    monkeypatch.setattr(lazy_data_classes, "_decorated", decorated)
    assert rod(1.0).length == 1.0
    other.join()
    assert found == [outcome(lambda: rod(2.0))]


FIRST_SCENES = """
import sys, threading, trunnion
sys.setswitchinterval(1e-6)
ready, failed = threading.Barrier(8), []
def load():
    ready.wait()
    try:
        joint = {"type": "revolute", "axis": "z", "inboard": "ground", "outboard": "b",
                 "effort": {"ramp": {"start": 0, "end": 1, "duration": 1}}}
        trunnion.scene_from_dict({"bodies": {"b": {"mass": 1, "inertia": [1, 1, 1]}}, "joints": {"r": joint}})
    except Exception as error:
        failed.append(repr(error))
threads = [threading.Thread(target=load) for _ in range(8)]
[t.start() for t in threads], [t.join() for t in threads]
sys.exit("; ".join(failed) or 0)
"""


def test_threads_may_load_their_first_scenes_at_once() -> None:
    run = subprocess.run([sys.executable, "-c", FIRST_SCENES], capture_output=True, text=True)
    assert run.returncode == 0, run.stderr


def test_a_validated_class_converts_and_refuses() -> None:
    @validated(frozen=True, config={"extra": "forbid"})
    class Pin:
        radius: float

    assert Pin("2.5").radius == 2.5  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="valid number"):
        Pin("wide")  # type: ignore[arg-type]


def test_the_engine_takes_dataclass_from_one_place() -> None:
    own = {ENGINE / "basics" / "lazy_data_classes.py", *(ENGINE / "packaging").rglob("*.py")}
    files = [f for f in ENGINE.rglob("*.py") if f not in own]
    assert not [
        f for f in files if re.search(r"^from (dataclasses|pydantic\.dataclasses) import .*\bdataclass\b", f.read_text(), re.M)
    ]
