"""What environments return, as it was at that moment."""

import numpy as np

__all__ = ["plain"]


def plain(value):
    """Anything that an environment returns, as copies of names, types and numbers that compare exactly."""
    if isinstance(value, dict):
        return {name: plain(one) for name, one in value.items()}
    if isinstance(value, tuple | list):
        return [plain(one) for one in value]
    if isinstance(value, np.ndarray):
        told = [plain(one) for one in value] if value.dtype == object else value.tobytes()
        return value.dtype.str, value.shape, told, value.tolist() if value.dtype != object else None
    return type(value).__name__, value
