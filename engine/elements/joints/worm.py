"""Worm and wheel: two wheels about crossed axes at a right angle. The worm is the inboard part (theory, "Worms")."""

from trunnion.elements.joints.joint_kind import E2, E3, JointKind, Rolls, slide

WORM = JointKind(
    name="worm",
    freedoms="sliding of the worm's thread, distance of the axes",
    axes=((slide(E3),), (slide(E2),)),
    rolls=Rolls(touch="skew"),
    friction="worm thread",
    contacts=1,
)
