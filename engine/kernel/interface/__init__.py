"""What a kernel offers: columns, quantities, and the tables that the runtime reads."""
