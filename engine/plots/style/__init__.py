"""Colours, captions, panels and files of all pictures."""
