"""The stability gallery as a table, beside what other programs do (``python -m tests.benchmarks.stability``)."""
