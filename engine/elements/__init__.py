"""Joint types, contact elements and friction laws."""
