"""Results do not depend on order, world axes, body frames, units, or the side from which a joint is described."""

import pytest

from tests.reference import solve
from tests.reference.scenes.frame_changes import reframed, rotated, shuffled
from tests.reference.scenes.joint_side_swap import swap_joint_sides
from tests.reference.scenes.random_scenes import random_loop, random_tree
from tests.reference.scenes.result_table import largest_difference, table
from tests.reference.scenes.unit_changes import rescaled

TOLERANCE = 1e-9  # roots are solved to 1e-11 of the forces


def case_of(seed: int):
    return random_tree(seed, t=0.3) if seed % 3 else random_loop(seed, t=0.3)


@pytest.mark.default_cases(2)
@pytest.mark.parametrize("seed", range(9))
def test_the_description_of_a_mechanism_does_not_change_its_results(seed):
    case = case_of(seed)
    base = table(solve(case.state()))
    ways = [shuffled(case, seed), rotated(case, seed), reframed(case, seed), rescaled(case, 1000.0, 1e-3, 2.0)]
    for name in case.scene.joints:
        try:
            ways.append(swap_joint_sides(case, name))
        except ValueError:
            continue
    for moved in ways:
        worst, where = largest_difference(base, moved.back(table(solve(moved.case.state()))))
        assert worst < TOLERANCE, (moved.case.scene.name, where)
