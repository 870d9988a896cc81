# SPDX-License-Identifier: MIT
"""Moving average of the last n values."""


class MovingAverage:
    """Mean of the last n values, in their own unit; of all of them until there are n.

    Paper 002 (stabilised platform), eqs. 24-25, n = 50. Eq. 25 prints the correction with the
    wrong sign; it is + (x_k - x_(k-n)) / n: as printed, the output runs away from the input.
    Delay (n - 1) / 2 samples. A running sum alone would collect the rounding of every sample
    that ever passed, which shows in single precision; so a second sum is built afresh during
    each round of the buffer and takes over when the round is complete.
    """

    def __init__(self, n=50):
        if n < 1:
            raise ValueError("n %s: at least 1" % n)
        self.n = n
        self.reset()

    def reset(self):
        """Forget everything; the next value is the mean."""
        self._values = [0.0] * self.n
        self._count = 0
        self._index = 0
        self._sum = 0.0
        self._round_sum = 0.0
        self.mean = 0.0

    def state(self):
        """The values that the mean is made of, oldest first; feed them to a new one to copy."""
        split = self._index if self._count == self.n else 0
        return self._values[split:self._count] + self._values[:split]

    def update(self, value):
        """One value -> mean of the last n; one that is not a finite number is left out."""
        if value - value != 0.0:  # inf or nan
            return self.mean
        index = self._index
        self._sum += value - self._values[index]
        self._round_sum += value
        self._values[index] = value
        if self._count < self.n:
            self._count += 1
        index += 1
        if index == self.n:
            index = 0
            self._sum = self._round_sum
            self._round_sum = 0.0
        self._index = index
        self.mean = self._sum / self._count
        return self.mean
