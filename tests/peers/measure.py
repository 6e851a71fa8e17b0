"""Errors of pictures and the statistics that judge them."""

import math

from workbench import np


def relmse(picture, reference):
    """Mean over pixels and channels of (I - R)^2 / (R^2 + 0.01 m^2), m the mean of R (the project's formula)."""
    return float(np.mean((picture - reference) ** 2 / _weight(reference)))


def relmse_of_pair(picture, pair):
    """relMSE against two independent converged pictures: in the product of both differences their noise cancels."""
    first, second = pair
    return float(np.mean((picture - first) * (picture - second) / _weight((first + second) / 2)))


def relmse_of_noise(variance, reference):
    """What `relmse` shows, in the mean, for a picture without bias whose pixels have this variance."""
    return float(np.mean(variance / _weight(reference)))


def _weight(reference):
    return reference**2 + 0.01 * np.mean(reference) ** 2


class Sums:
    """Mean of independent pictures, pixel by pixel, and the variance of that mean (Welford)."""

    def __init__(self):
        self.count, self.mean, self.squares = 0, 0.0, 0.0

    def add(self, picture):
        self.count += 1
        delta = picture - self.mean
        self.mean = self.mean + delta / self.count
        self.squares = self.squares + delta * (picture - self.mean)

    def variance(self):
        """Variance of the mean."""
        return self.squares / (self.count * (self.count - 1))


def welch(a, b, floor):
    """Student's t and its degrees of freedom (Welch) of the difference of two `Sums`, value by value.

    `floor` is added to the variances: the least that rounding to float32 leaves.
    """
    va, vb = a.variance() + floor, b.variance() + floor
    t = (a.mean - b.mean) / np.sqrt(va + vb)
    return t, (va + vb) ** 2 / (va**2 / (a.count - 1) + vb**2 / (b.count - 1))


def two_sided_p(t, freedom):
    """Probability of |t| or more under Student's distribution: the incomplete beta function I_x(n/2, 1/2)."""
    x = freedom / (freedom + t * t)
    return _incomplete_beta(freedom / 2, 0.5, x)


def _incomplete_beta(a, b, x):
    """Regularised, by the continued fraction of Numerical Recipes 6.4 (modified Lentz)."""
    a, x = np.broadcast_arrays(np.asarray(a, float), np.asarray(x, float))
    x = np.clip(x, 1e-300, 1 - 1e-16)
    gammaln = np.vectorize(math.lgamma)
    front = np.exp(gammaln(a + b) - gammaln(a) - math.lgamma(b) + a * np.log(x) + b * np.log1p(-x))
    swap = x > (a + 1) / (a + b + 2)
    direct = front * _beta_fraction(a, np.full_like(a, b), x) / a
    swapped = 1 - front * _beta_fraction(np.full_like(a, b), a, 1 - x) / b
    return np.where(swap, swapped, direct)


def _beta_fraction(a, b, x):
    tiny = 1e-30
    c = np.ones_like(x)
    d = 1 / np.maximum(1 - (a + b) * x / (a + 1), tiny)
    h = d.copy()
    for m in range(1, 200):
        for numerator in (
            m * (b - m) * x / ((a + 2 * m - 1) * (a + 2 * m)),
            -(a + m) * (a + b + m) * x / ((a + 2 * m) * (a + 2 * m + 1)),
        ):
            d = 1 / _away_from_zero(1 + numerator * d, tiny)
            c = _away_from_zero(1 + numerator / c, tiny)
            h *= d * c
    return h


def _away_from_zero(x, tiny):
    return np.where(np.abs(x) < tiny, tiny, x)
