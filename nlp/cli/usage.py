"""Earlier names of options."""

from __future__ import annotations

from .commandline import print_notice

#: Earlier names of options by command: they work with a notice, and no help lists them. An empty name has no effect.
EARLIER = {
    "report": {"--html": "--out"},
    "tradeoff": {"--page": "--html"},
    "sweep": {"--points": "--over"},
    "pareto": {"--goals": "--goal"},
    "compare": {"--range": "--part"},
    "workspace": {"--of-quantity": "--quantity", "--picture": "--plot-pose"},
    "codegen": {"--measure": ""},
}
#: The first version that may be without these names: see docs/versions.md.
_UNTIL = "0.3"


def with_present_names(command: str, words: list[str]) -> list[str]:
    """Return the words of a command line with present names of options, and print a notice for each earlier name."""
    names = EARLIER.get(command, {})
    end = words.index("--") if "--" in words else len(words)
    parts = [word.partition("=") for word in words[:end]]
    named = [names.get(name, name) + equals + value for name, equals, value in parts if names.get(name) != ""]
    for name in dict.fromkeys(name for name, _, _ in parts if name in names):
        fault = f"is an earlier name of {names[name]}, and" if names[name] else "has no effect any more, and"
        print_notice(f"screwsynth: {command} {name}: {fault} works until {_UNTIL}")
    return [*named, *words[end:]]
