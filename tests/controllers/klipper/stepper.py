"""Interface facts of Klipper's rails for tests."""

from types import SimpleNamespace

from chelper import get_ffi


class PrinterRail:
    """Rail with a motor in radians."""

    def __init__(self, config: str, *, units_in_radians: bool = False) -> None:
        assert units_in_radians
        self._name = config

    def get_name(self) -> str:
        """Return the name of the section."""
        return self._name

    def get_homing_info(self) -> SimpleNamespace:
        """Return the position of the endstop."""
        return SimpleNamespace(position_endstop=0.0)

    def get_range(self) -> tuple[float, float]:
        """Return the limits of the motor."""
        return -1.2, 1.2

    def setup_itersolve(self, allocate: str, motor: int) -> None:
        """Make a step generator."""
        assert getattr(get_ffi()[1], allocate)(motor)

    def get_steppers(self) -> list[object]:
        """Return no steppers: the test makes its own."""
        return []

    def set_position(self, position: list[float]) -> None:
        """Take a position."""
        assert len(position) == 3
