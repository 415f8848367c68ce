"""MJCF parts that the twin builds its scene from; found through ``importlib.resources``."""
