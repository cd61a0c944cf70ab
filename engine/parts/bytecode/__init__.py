"""Programs of primitive calls, and the C interpreter that executes them."""
