"""What is kept: jobs, their chunks and attempts, events, API keys. SQLite or PostgreSQL, by URL."""
