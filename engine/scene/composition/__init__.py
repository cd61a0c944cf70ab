"""Composition: modules that replace includes, assemblies and copies, which only files have, by plain bodies, joints and forces."""
