"""Reading and checking requests in processes of their own: nothing a client sends keeps the server from answering the others."""
