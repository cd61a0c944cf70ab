"""A mechanism as surfaces and marks in space."""
