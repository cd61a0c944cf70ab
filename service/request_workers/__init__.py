"""Worker processes that read and check requests, so that no request blocks the server."""
