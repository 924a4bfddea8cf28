"""Counterfactual rooms: one attribute of a scene changed, everything else identical to the byte."""

from grammar.counterfactual.apply import apply_change, as_base, current_value
from grammar.counterfactual.change import Change, ChangeError, InvalidChangeError
from grammar.counterfactual.factor import Factor
from grammar.counterfactual.factors import FACTORS

__all__ = ["FACTORS", "Change", "ChangeError", "Factor", "InvalidChangeError", "apply_change", "as_base", "current_value"]
