"""Composition: includes, assemblies and copies, which only files have, are replaced by plain bodies, joints and forces."""
