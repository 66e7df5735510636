"""Case files that come with the package: the paper's examples and starting points for designs."""
