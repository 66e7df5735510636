"""``python -m screwsynth.nlp`` is the command line."""

from screwsynth.nlp.cli import main

main()
