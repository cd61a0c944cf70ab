"""The compiler, the cache of libraries, and the libraries of the installation."""
