"""The database store of jobs, their chunks, attempts and events, and of API keys."""
