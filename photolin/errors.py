"""Everything photolin raises on purpose.

    PhotolinError
    ├── InputError        a file or folder cannot be used: names it and says what is accepted
    ├── OptionError       a value is out of range: names it and says the range
    ├── DegenerateError   the images or lights do not determine a solution
    ├── OutputError       a result cannot be written or read back
    └── Cancelled         the caller's `cancel` said so

Every message is one sentence that says what was wrong, where, and what is accepted; the command
line prints it after ``photolin:`` and the web tool shows the same words as a notification.
"""


class PhotolinError(Exception):
    """Base of all errors a user can cause and mend."""


class InputError(PhotolinError):
    """A file or folder cannot be used as given."""


class OptionError(PhotolinError):
    """A value lies outside its range."""


class DegenerateError(PhotolinError):
    """The images or lights do not determine a solution."""


class OutputError(PhotolinError):
    """A result cannot be written, or a written one cannot be read back."""


class Cancelled(PhotolinError):
    """Work stopped because the caller asked for it; nothing was written."""
