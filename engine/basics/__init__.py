"""Small tools for all folders of the engine. This folder imports none of them."""
