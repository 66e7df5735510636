"""Robot files: a robot given joint by joint in TOML, read with its faults as sentences (``schema``, ``reader``)."""
