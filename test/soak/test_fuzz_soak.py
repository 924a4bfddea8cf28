"""A long campaign of fuzzing; ``SOAK_CASES`` says how many cases, ``SOAK_SEED`` which (drawn from the clock where it is not set)."""

import os
import time

import pytest
from fuzz.campaign import run_campaign

CASES = int(os.environ.get("SOAK_CASES", "100000"))
SEED = int(os.environ.get("SOAK_SEED", time.time_ns() % 2**32))


@pytest.mark.soak
def test_a_long_campaign_finds_no_fault() -> None:
    outcome = run_campaign(CASES, SEED)
    print(f"\nseed {SEED}\n{outcome.report()}")
    assert sum(outcome.cases.values()) >= CASES and not outcome.faults
