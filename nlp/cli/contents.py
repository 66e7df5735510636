"""What commands show and write: the functions of ``contents.pyi``, each imported when it is first used."""

from ..system.lazynames import lazy_names

_, __getattr__ = lazy_names(__name__, __package__, __file__)
