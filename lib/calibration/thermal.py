# SPDX-License-Identifier: MIT
"""The gyro's bias over temperature, learned whenever the robot rests."""


class BiasLearner:
    """A line through (temperature, bias) of each gyro axis, older rests counting less.

    memory: how many rests count. Until rests have covered `span_c` degrees (standard deviation)
    the slope of the calibration given at the start is kept and only the bias moves.
    """

    def __init__(self, cal, memory=50, span_c=2.0):
        self._cal = cal
        self._keep = 1 - 1 / memory
        self._least = span_c * span_c
        self._weight = 0.0
        self._temp = 0.0  # weighted mean temperature
        self._bias = [0.0, 0.0, 0.0]  # weighted mean biases
        self._spread = 0.0  # weighted sum of squared temperature deviations
        self._product = [0.0, 0.0, 0.0]  # weighted sums of temperature by bias deviations

    def rested(self, temp_c, gyro_dps):
        """One rest: the temperature (degC) and the raw mean rates (deg/s, not calibrated)."""
        self._weight = self._weight * self._keep + 1
        step = temp_c - self._temp
        self._temp += step / self._weight
        self._spread = self._spread * self._keep + step * (temp_c - self._temp)
        for i in range(3):
            self._bias[i] += (gyro_dps[i] - self._bias[i]) / self._weight
            product = step * (gyro_dps[i] - self._bias[i])
            self._product[i] = self._product[i] * self._keep + product

    def calibration(self):
        """The calibration with the bias, and where known the slope, learned so far."""
        if not self._weight:
            return self._cal
        slopes = self._cal.gyro_slope_dps_per_c
        if self._spread >= self._least * self._weight:
            slopes = tuple([p / self._spread for p in self._product])
        return self._cal.at(self._temp).but(
            gyro_bias_dps=tuple(self._bias), gyro_slope_dps_per_c=slopes
        )
