"""Page with a robot that solves while its sliders move: one file, which needs no network and no server."""
