"""Command line as ``python -m screwsynth.nlp``."""

from .cli.main import main

main()
