"""Scenes made of parts: functions of any numbers, compiled once a machine, and tapes of calls that a scene is (METHOD, "Parts")."""
