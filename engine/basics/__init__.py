"""Small things that every other folder of the engine uses; nothing here imports from those folders."""
