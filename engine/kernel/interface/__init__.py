"""What a kernel offers: columns, quantities and the tables the runtime reads."""
