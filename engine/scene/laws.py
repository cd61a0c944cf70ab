"""Friction laws a scene may name in this version, and the numbers each needs."""

AVAILABLE_LAWS = {"coulomb", "lugre", "regularized", "stribeck", "viscous"}
"""Laws that are built (the format knows more: ``jointed.Law``)."""

NEEDS = {"viscous": ("viscosity",), "stribeck": ("mu", "mu_static", "v_stribeck"), "lugre": ("mu", "bristle_stiffness")}
"""The numbers a law cannot do without; all others need ``mu``."""
