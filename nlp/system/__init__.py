"""Files and programs of this machine, for every other room."""
