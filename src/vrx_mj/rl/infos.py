"""What vector environments return beside the numbers, in the form of Gymnasium's own: values, and masks of whose."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from vrx_mj.arrays import BoolArray
from vrx_mj.rl.features import Floats32

__all__ = ["final", "masked"]


def masked(facts: Mapping[str, npt.NDArray[Any]], rows: BoolArray) -> dict[str, Any]:
    """`info` for the facts of some rows, (n, ...): zeros for other rows, a mask `_NAME` beside each; {} for no row."""
    info: dict[str, Any] = {}
    if rows.any():
        for name, value in facts.items():
            wide = rows.reshape(-1, *[1] * (value.ndim - 1))
            info[name], info[f"_{name}"] = np.where(wide, value, np.zeros_like(value)), rows.copy()
    return info


def final(facts: Mapping[str, npt.NDArray[Any]], observation: Floats32, ended: BoolArray) -> dict[str, Any]:
    """`info` for the last observations and facts of the rows whose episodes have just ended, (n,); None for others."""
    seen = np.full(len(observation), None, object)
    for row in np.flatnonzero(ended).tolist():
        seen[row] = observation[row].copy()
    facts_of_ended = masked(facts, ended)
    return {"final_obs": seen, "_final_obs": ended.copy(), "final_info": facts_of_ended, "_final_info": ended.copy()}
