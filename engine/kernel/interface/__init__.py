"""Interface of a kernel: its columns, quantities, and the tables that the runtime reads."""
