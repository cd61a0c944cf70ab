"""Small things every other folder of the engine stands on; imports nothing from them."""
