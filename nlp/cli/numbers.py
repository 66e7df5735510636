"""Readers of options that are numbers: a wrong one is refused in one sentence with its value."""

from __future__ import annotations


class WholeNumber:
    """Reader of an option that is a whole number.

    Attributes:
        option: name of the option.
        least, most: smallest and largest allowed number; no largest one for None.
    """

    def __init__(self, option: str, least: int, most: int | None = None) -> None:
        self.option, self.least, self.most = option, least, most
        # The command line names the type of an option by its reader.
        self.__name__ = "N"

    def __call__(self, text: str | int) -> int:
        """Return the number.

        Raises:
            InputError: the text is no whole number, or the number is not allowed.
        """
        from ..errors import InputError

        try:
            number = int(text)
        except ValueError:
            number = self.least - 1
        if number < self.least or (self.most is not None and number > self.most):
            allowed = f"of at least {self.least}" if self.most is None else f"from {self.least} to {self.most}"
            raise InputError(f"{self.option} {text}: must be a whole number {allowed}")
        return number


class Number:
    """Reader of an option that is a number; the command checks whether it is allowed.

    Attributes:
        option: name of the option.
    """

    def __init__(self, option: str) -> None:
        self.option = option
        self.__name__ = "NUMBER"

    def __call__(self, text: str | float) -> float:
        """Return the number.

        Raises:
            InputError: the text is no number.
        """
        from ..errors import InputError

        try:
            return float(text)
        except ValueError:
            raise InputError(f"{self.option} {text}: must be a number") from None
