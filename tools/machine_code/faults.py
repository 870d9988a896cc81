# SPDX-License-Identifier: MIT
"""How the run of a function ends when it does not end well."""


class MachineFault(Exception):
    """Code that a processor would not run: it reads where nothing is, jumps away, never ends.

    address: of the instruction, where it is known.
    """

    def __init__(self, text, address=None):
        super().__init__(text)
        self.address = address


class Impure(Exception):
    """The function reaches what is more than numbers and buffers; the text says what.

    last: the latest one; board code that is called may catch all that is raised.
    """

    last = None

    def __init__(self, text):
        super().__init__(text)
        Impure.last = self
