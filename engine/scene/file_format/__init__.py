"""Reading and writing of scenes as YAML, and their JSON Schema."""
