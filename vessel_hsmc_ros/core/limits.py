"""The saturation function of control engineering."""


def clip(value: float, limit: float) -> float:
    """Saturate a value symmetrically: min(max(value, -limit), limit), with limit >= 0."""
    return min(max(value, -limit), limit)
