"""Contents of commands: functions of ``contents.pyi``, each imported at first use."""

from ..system.lazynames import lazy_names

_, __getattr__ = lazy_names(__name__, __package__, __file__)
