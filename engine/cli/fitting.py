"""``trunnion fit``: words to measured runs and what is looked for; what was found as text, JSON and a picture."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from engine.cli import options
from engine.cli.fitted import draw, lines, proposal_lines
from engine.cli.options import Findings
from engine.cli.running import DONE, FAILED, print_json
from engine.cli.simulating import PICTURES, loaded, talk

if TYPE_CHECKING:
    from engine.fits import Candidate, Measured, Trial
    from engine.scene.model import Scene

EXAMPLE = "for example --to joints.pivot.friction.mu"


@dataclass(frozen=True)
class FitWish:
    """The words and options of the command as they were written."""

    scene: list[str]
    data: Sequence[str] = ()
    to: Sequence[str] = ()
    own: Sequence[str] = ()
    column: Sequence[str] = ()
    noise: Sequence[str] = ()
    level: str = "0.95"
    compare: Sequence[str] = ()
    trials: Sequence[str] = ()
    changes: Sequence[str] = ()
    plot: str | None = None
    as_json: bool = False
    verbose: bool = False


@dataclass
class Asked:
    """A wish as it was understood: what is fitted, its bounds and priors, the runs, the files' columns that are not used, laws to
    compare, experiments to rank."""

    shared: list[str] = field(default_factory=list)
    own: list[str] = field(default_factory=list)
    bounds: dict[str, tuple[str | None, str | None]] = field(default_factory=dict)
    priors: dict[str, str] = field(default_factory=dict)
    runs: list[Measured] = field(default_factory=list)
    unused: list[str] = field(default_factory=list)
    level: float = 0.95
    candidates: dict[str, Candidate] = field(default_factory=dict)
    trials: dict[str, Trial] = field(default_factory=dict)


def fit_command(wish: FitWish) -> int:
    """Fit, compare laws or rank experiments as asked, and tell it; the exit code (1 where a search did not come to its end)."""
    from engine.cli.charting import print_lines
    from engine.cli.progress import Watch
    from engine.fits import compare, fit, propose

    talk(wish.verbose)
    found = Findings()
    picture = options.destination(wish.plot, PICTURES, "--plot", found)
    scene, asked = wished(wish, found)
    candidates, trials = asked.candidates, asked.trials
    extra: dict[str, Any] = {"runs": asked.runs, "own": asked.own, "bounds": asked.bounds, "priors": asked.priors}
    with Watch("fit"):
        evidence = compare(scene, candidates, asked.shared, **extra, level=asked.level) if candidates else None
        best = evidence.best.fit if evidence else fit(scene, asked.shared, **extra, level=asked.level)
        assert best is not None
        ranked = propose(best, trials) if trials else ()
    if picture is not None:
        draw(best, picture)
    code = DONE if best.converged else FAILED
    files = [str(picture)] if picture is not None else []
    if wish.as_json:
        more: dict[str, Any] = {"compared": evidence.document()} if evidence else {}
        more |= {"experiments": [p.document() for p in ranked]} if ranked else {}
        print_json({"exit_code": code, "problems": [], **best.document(), **more, "unused": asked.unused, "files": files})
    else:
        told = [*lines(scene.name, best, evidence), *proposal_lines(ranked, best)]
        told += [f"not used: {', '.join(asked.unused)}"] if asked.unused else []
        print_lines([*told, *(f"wrote {f}" for f in files)])
    return code


def wished(wish: FitWish, found: Findings) -> tuple[Scene, Asked]:
    """(the scene, what is asked of it); SceneError with every mistake."""
    source = options.one_scene(wish.scene, found)
    scene = loaded(source, options.assignments(wish.changes, found), None, found)
    asked = understood(wish, scene, found)
    asked.candidates = {n: c for text in wish.compare for n, c in _candidate(text, found)}
    asked.trials = {text: _trial(text, scene, found) for text in wish.trials}
    found.end()
    assert scene is not None
    return scene, asked


def understood(wish: FitWish, scene: Scene | None, found: Findings) -> Asked:
    """What is asked for; mistakes are noted."""
    from engine.fits.files import read_measured

    out = Asked()
    for texts, names, where in ((wish.to, out.shared, "--to"), (wish.own, out.own, "--own")):
        for text in texts:
            _looked_for(text, names, out, where, found)
    if not out.shared and not any("~" in text for text in wish.compare):
        found.add("--to", "nothing says what is to be found", EXAMPLE)
    level = options.quantity(wish.level, "1", "--level", found)
    out.level = 0.95 if level is None else level
    renamed = _pairs(wish.column, "--column", "--column 'pivot.q[1]=angle'", found)
    noise = _noise(wish.noise, found)
    if not wish.data:
        found.add("--data", "nothing is measured", "--data FILE.csv, with columns time and those of the scene")
    for text in wish.data:
        file, *changes = _parts(text)
        overrides = options.assignments(changes, found)
        if scene is not None:
            read = found.attempt(partial(read_measured, file, scene, renamed, overrides, noise))
            if read is not None:
                out.runs.append(_called(read[0], Path(file).stem, out.runs))
                out.unused += [f"{file}: {n}" for n in read[1]]
    return out


def _called(run: Measured, name: str, others: Sequence[Measured]) -> Measured:
    """The run with the name of its file, and a number where another has that."""
    from dataclasses import replace

    taken = sum(r.name.partition(" #")[0] == name for r in others)
    return replace(run, name=f"{name} #{taken + 1}" if taken else name)


def _parts(text: str) -> list[str]:
    return [part.strip() for part in text.split(";") if part.strip()] or [text]


def _looked_for(text: str, names: list[str], out: Asked, where: str, found: Findings) -> None:
    """PATH, PATH=low:high (one end may be left out), PATH=normal(…) or PATH=lognormal(…)."""
    path, sign, said = (part.strip() for part in text.partition("="))
    if path not in names:
        names.append(path)
    if not sign:
        return
    low, colon, high = (part.strip() for part in said.partition(":"))
    if "(" in said:
        out.priors[path] = said
    elif colon and (low or high):
        out.bounds[path] = (low or None, high or None)
    else:
        hint = "PATH alone, PATH=low:high, PATH=normal(mean, deviation) or PATH=lognormal(mean, deviation)"
        found.add(where, f"{text!r} says neither bounds nor a prior", hint)


def _pairs(texts: Sequence[str], where: str, example: str, found: Findings) -> dict[str, str]:
    out = {}
    for text in texts:
        name, sign, value = (part.strip() for part in text.partition("="))
        if not sign or not name or not value:
            found.add(where, f"{text!r} is not NAME=VALUE", f"for example {example}")
        out[name] = value
    return out


def _noise(texts: Sequence[str], found: Findings) -> float | Mapping[str, float] | None:
    """One standard deviation, or one for each column; SI, or with a unit."""
    from engine.scene.quantities import AnyUnit
    from engine.scene.units import UnitError

    def read(text: str) -> float:
        try:
            return float(AnyUnit()(text))
        except UnitError as e:
            found.add("--noise", e.what, e.hint or "for example --noise '0.5 mrad', or --noise 'pivot.q[1]=0.5 mrad'")
            return 1.0

    if len(texts) == 1 and "=" not in texts[0]:
        return read(texts[0])
    return {n: read(v) for n, v in _pairs(texts, "--noise", "--noise 'pivot.q[1]=0.5 mrad'", found).items()} or None


def _candidate(text: str, found: Findings) -> list[tuple[str, Candidate]]:
    """LAW; PATH~GUESS (fitted, from there); PATH=VALUE (held)."""
    from engine.fits import Candidate

    law, *words = _parts(text)
    fitted, changes = [], {}
    for word in words:
        path, sign, guess = (part.strip() for part in word.partition("~"))
        if sign:
            fitted.append(path)
        changes.update(options.assignments([f"{path}={guess}" if sign else word], found))
    options.choice(law, options.laws(), "--compare", found)
    return [(law if not words else text, Candidate(fitted, law, changes))]


def _trial(text: str, scene: Scene | None, found: Findings) -> Trial:
    """PATH=VALUE; …; until=T; every=DT."""
    from engine.fits import Trial
    from engine.scene.overrides import apply

    changes = options.assignments(_parts(text), found)
    times = {k: changes.pop(k) for k in ("until", "every") if k in changes}
    if scene is not None and changes:
        found.attempt(partial(apply, scene, changes), "--try")
    return Trial(changes, **times)
