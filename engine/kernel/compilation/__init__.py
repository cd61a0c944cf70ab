"""Compiler, cache of libraries, libraries of the installation."""
