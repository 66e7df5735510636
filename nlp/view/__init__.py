"""Live view of a case: its generated C and the geometry of its robot as a WebAssembly module, and data for the page."""
