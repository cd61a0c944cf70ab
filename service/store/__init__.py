"""The store: jobs with chunks and attempts, events, API keys."""
