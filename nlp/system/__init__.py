"""Files and programs of this computer, for every other room."""
