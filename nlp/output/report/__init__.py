"""Pages of HTML about solutions, workspaces, paths and tables of designs."""
