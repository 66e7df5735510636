"""Pictures of a robot and its task as files."""
