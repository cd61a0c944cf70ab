"""Number of contacts of each element, for whoever must not wait for the symbolic library."""

CONTACT_COUNT = {"journal": 2, "shaft": 2, "ball": 1, "universal": 4, "sleeve": 5}
