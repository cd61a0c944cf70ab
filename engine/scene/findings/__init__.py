"""Problems of a scene, with place, cause and remedy."""
