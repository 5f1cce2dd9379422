"""The wave spectrum: JONSWAP, and with a peak enhancement of 1 Pierson-Moskowitz (ITTC); the symbols are those of `waves`."""

import math

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def spectrum(omega: Array, significant_height: float, peak: float, gamma: float) -> Array:
    """The JONSWAP spectrum S(omega) with the normalisation 1 - 0.287·ln gamma.

    Args:
        omega: Frequencies, rad/s, above 0.
        significant_height: H_s, m.
        peak: omega_p, rad/s.
        gamma: Peak enhancement factor; 1 gives the Pierson-Moskowitz spectrum.

    Returns:
        Spectral density, m²·s, of the shape of omega.
    """
    # Standard peak widths of JONSWAP below and above the peak.
    width = np.where(omega <= peak, 0.07, 0.09)
    enhancement = gamma ** np.exp(-0.5 * ((omega - peak) / (width * peak)) ** 2)
    pierson_moskowitz = 5.0 / 16.0 * significant_height**2 * peak**4 / omega**5 * np.exp(-1.25 * (peak / omega) ** 4)
    return np.asarray((1.0 - 0.287 * math.log(gamma)) * pierson_moskowitz * enhancement)


def frequencies(shares: Array, peak: float, gamma: float) -> Array:
    """Quantiles of the spectrum: the frequencies below which given shares of the energy lie, rad/s.

    Args:
        shares: Shares of the energy, in [0, 1].
        peak: omega_p, rad/s.
        gamma: Peak enhancement factor.

    Returns:
        Frequencies, rad/s, of the shape of shares.
    """
    # Practically all of the energy lies between 0.3 and 6 times the peak frequency.
    omega = peak * np.linspace(0.3, 6.0, 4000)
    energy = np.cumsum(spectrum(omega, 1.0, peak, gamma))
    return np.interp(shares, energy / energy[-1], omega)
