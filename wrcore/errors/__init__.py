"""The one error that a user can cause."""


class InputError(ValueError):
    """Something a person wrote cannot be used; nothing has been started yet.

    Parameters
    ----------
    source : str
        File (or command-line option) that holds the fault.
    field : str
        Key, column or line inside the source; may be empty.
    expected : str
        What was expected there, and what was found.

    Notes
    -----
    ``str(error)`` is always one line. The command line prints it and ends with status 2.
    """

    def __init__(self, source, field, expected):
        self.source, self.field, self.expected = str(source), str(field), str(expected)
        super().__init__(": ".join(" ".join(part.split()) for part in (self.source, self.field, self.expected) if part))
