"""Work-precision diagrams: error against stepping time of a scene, for every method, tolerance and friction law."""
