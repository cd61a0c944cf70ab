"""Every block of every page, run as it is printed."""
