"""Interface facts of Klipper's helper for tests: calls into a library of C as cffi makes them."""

import ctypes


class Interface:
    """Memory for C."""

    def new(self, kind: str, given: object = 3) -> ctypes.Array[ctypes.c_double]:
        """Return an array of numbers."""
        assert kind in ("double[]", "double[3]")
        values = [0.0] * given if isinstance(given, int) else list(given)  # type: ignore[call-overload]
        return (ctypes.c_double * len(values))(*values)


class Calls:
    """Functions of a library."""

    def __init__(self, library: ctypes.CDLL) -> None:
        self._library = library

    def __getattr__(self, name: str) -> object:
        function = getattr(self._library, name)
        return lambda *given: function(*[ctypes.c_double(each) if isinstance(each, float) else each for each in given])


#: Library of the test.
libraries: list[ctypes.CDLL] = []


def get_ffi() -> tuple[Interface, Calls]:
    """Return the interface and the functions."""
    return Interface(), Calls(libraries[-1])
