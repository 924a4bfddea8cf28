"""Counterfactual rooms: one attribute of a scene changed, everything else identical to the byte."""

from grammar.counterfactual.change import Change, ChangeError, Factor, InvalidChangeError
from grammar.counterfactual.factors import FACTORS, apply_change, as_base, current_value

__all__ = ["FACTORS", "Change", "ChangeError", "Factor", "InvalidChangeError", "apply_change", "as_base", "current_value"]
