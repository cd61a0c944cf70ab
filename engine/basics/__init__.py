"""Small tools for all folders of the engine. The modules here import nothing from the other folders."""
