"""``python -m screwsynth.nlp`` is the command line."""

from .cli.main import main

main()
