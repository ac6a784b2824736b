# SPDX-License-Identifier: Apache-2.0
"""The exceptions of twocone. Their texts are those of the program: one line that says what is wrong and where."""


class Error(RuntimeError):
    """The base of all exceptions of this package."""


class FileError(Error):
    """A file or folder is wrong or cannot be read or written. The text names it, the line, the key and what is valid."""


class DeviceError(Error):
    """A device, a simulation or an image failed. ``code`` is a :class:`twocone.FailureCode`."""

    def __init__(self, message, code):
        super().__init__(message)
        self.code = code

    def __reduce__(self):
        return type(self), (str(self), self.code)


class DeviceTimeout(DeviceError, TimeoutError):
    """Nothing arrived before the deadline. It is safe to try again."""
