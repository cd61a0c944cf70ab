"""Programs and tables as the kernel of one scene."""
