"""Tests that run every block of every page as printed."""
