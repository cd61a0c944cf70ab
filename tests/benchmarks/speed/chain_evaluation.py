"""One evaluation of a chain of N revolute joints (axes alternately y, z; unit rods of 1 kg): ns per body.

Accelerations; accelerations with the reactions of all joints; and the frictional chain (journals, maps and complement solve). Times
are measured inside C, without call overhead. If Pinocchio is installed, its ABA (accelerations only) is measured through its Python
package.
"""

from __future__ import annotations

import ctypes
import tempfile
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

from tests.benchmarks.speed.processor_time import clocked, pin
from tests.scalable_mechanisms import revolute_chain
from trunnion.kernel.c_code.code_generator import Output, Stage, emit
from trunnion.kernel.compilation import c_compiler, library_cache
from trunnion.kernel.units.generated_function_inputs import CONST, STATE, inputs
from trunnion.recursion.inward_reduction import model
from trunnion.recursion.outward_accelerations import outward
from trunnion.recursion.symbolic_inputs import Symbols
from trunnion.recursion.vector_algebra import SX
from trunnion.scene.data_classes import scene as sm
from trunnion.simulation.run import Model
from trunnion.simulation.runtime_interface.simulation_block import Block, Settings
from trunnion.system.construction.system_builder import build

LOOP = """
#include <time.h>
double bench(long n,const double*x,double*y,const double*c,double*w,double*maps,double*dy){double power[1];
struct timespec a,b;clock_gettime(CLOCK_MONOTONIC,&a);double q=y[0];
for(long i=0;i<n;++i){y[0]=q+1e-9*(i&1);k_stage1(x,y,c,w,maps,dy,power);}
y[0]=q;clock_gettime(CLOCK_MONOTONIC,&b);return ((b.tv_sec-a.tv_sec)*1e9+(b.tv_nsec-a.tv_nsec))/n;}
"""
SIZES = (1, 2, 4, 8, 16, 32, 64, 128, 256)


def unrolled(sym: Symbols, reactions: bool) -> tuple[str, int, int]:
    """The chain's equations as unrolled C: (source, constants, number of work variables)."""
    m = model(sym)
    acc = outward(m, reactions=reactions)
    nq = sym.system.nq
    outs = [Output("dy", nq, [a[i] for a in acc.qdd for i in range(a.numel())], 1)]
    if reactions:
        outs.append(Output("maps", 0, [SX(n) for n in acc.N], 1))
    stages = [
        Stage("k_prepare", f"{CONST}p,double*restrict c", "c"),
        Stage("k_stage1", f"{STATE},double*restrict w,double*restrict maps,double*restrict dy,double*restrict power", "w"),
    ]
    code = emit(inputs(sym), outs, stages)
    return code.text, code.kept[0], code.kept[1]


def measured(n: int, reactions: bool) -> tuple[float, float, float, np.ndarray]:
    """Measure a chain of n bodies: (minimum and median ns per body, seconds to compile, accelerations)."""
    built = build(revolute_chain(n))
    values = np.array(built.parameters.values)
    sym = Symbols(built.system, len(values))
    started = time.perf_counter()
    text, nc, nw = unrolled(sym, reactions)
    folder = Path(tempfile.mkdtemp())
    (folder / "chain.c").write_text("#include <math.h>\n" + text + LOOP)
    library = folder / f"chain{c_compiler.library_suffix()}"
    c_compiler.build_library([folder / "chain.c"], library, [], library_cache.cache_folder())
    took = time.perf_counter() - started
    lib = ctypes.CDLL(str(library))
    lib.bench.restype = ctypes.c_double
    arrays = {
        k: (ctypes.c_double * (m + 8))()
        for k, m in {"x": 8, "y": 2 * n, "c": nc, "w": nw, "maps": 6 * n, "dy": 2 * n, "p": len(values)}.items()
    }
    arrays["p"][: len(values)] = values
    arrays["y"][: 2 * n] = [*built.numbers.q, *built.numbers.v]
    lib.k_prepare(arrays["p"], arrays["c"])
    order = [arrays[k] for k in ("x", "y", "c", "w", "maps", "dy")]
    times = sorted(lib.bench(ctypes.c_long(max(20, 40000 // n)), *order) / n for _ in range(61))
    return times[0], times[30], took, np.array(arrays["dy"][n : 2 * n])


def frictional(n: int) -> float:
    """ns per body of one full evaluation with journal friction in every joint (call overhead of ctypes subtracted)."""
    scene = revolute_chain(n)
    friction = sm.Friction(mu=0.1, radius=0.01, half_length=0.05, law="regularized", v_eps=1e-3)
    scene = replace(scene, joints={k: replace(j, friction=friction) for k, j in scene.joints.items()})
    block: Block = Model(scene, [next(iter(scene.joints)) + ".q[1]"]).block
    block.configure(Settings())
    block.assemble()
    block.start(0.0, 1.0, 1.0, np.zeros(block.width))
    dy, z = np.zeros(2 * n + 8), np.zeros(n + 8)
    low, _ = clocked(lambda: block.lib.tr_evaluate(block.at, dy.ctypes.data, z.ctypes.data))
    overhead, _ = clocked(lambda: block.lib.tr_time(block.at))
    return (low - overhead) * 1e9 / n


def pinocchio(n: int) -> float | None:
    """ns per body of pin.aba from Python; None if Pinocchio is not installed."""
    try:
        import pinocchio as pin_
    except ImportError:
        return None
    m, parent = pin_.Model(), 0
    for i in range(n):
        place = pin_.SE3.Identity()
        place.translation = np.array([1.0 if i else 0.0, 0, 0])
        parent = m.addJoint(parent, pin_.JointModelRZ() if i % 2 else pin_.JointModelRY(), place, f"j{i}")
        m.appendBodyToJoint(parent, pin_.Inertia(1.0, np.array([0.5, 0, 0]), np.diag([1e-3, 1 / 12, 1 / 12])), pin_.SE3.Identity())
    d, q, v, tau = m.createData(), np.full(n, 0.1), np.full(n, 0.2), np.zeros(n)
    return clocked(lambda: pin_.aba(m, d, q, v, tau))[0] * 1e9 / n


def main() -> None:
    """Print the table."""
    pin()
    head = ("N", "acc min", "median", "+reactions", "median", "build s", "frictional", "pinocchio", "ratio")
    print("ns per body\n" + "".join(f"{h:>12s}" for h in head))
    for n in SIZES:
        a, b = measured(n, False), measured(n, True)
        other = pinocchio(n)
        friction = f"{frictional(n):12.0f}" if n <= 64 else f"{'-':>12s}"
        peer = f"{other:12.0f}{b[0] / other:12.2f}" if other else f"{'-':>12s}{'-':>12s}"
        print(f"{n:12d}{a[0]:12.1f}{a[1]:12.1f}{b[0]:12.1f}{b[1]:12.1f}{b[2]:12.2f}{friction}{peer}")


if __name__ == "__main__":
    main()
