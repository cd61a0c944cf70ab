"""Small tools for all folders of the engine. These modules import nothing from the other folders."""
