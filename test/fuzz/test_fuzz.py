"""Every reader of files from others reads what is spoiled, or refuses it in one line, within bounds; and a campaign finds what does not."""

from collections import Counter

import pytest
from fuzz.campaign import run_campaign
from fuzz.cases import TABLES, make_case
from fuzz.mutations import NUMBERS, OF_TREES
from fuzz.planted import READERS as PLANTED
from fuzz.readers import READERS

CASES, SEED = 5000, 26


def test_every_reader_reads_or_refuses_what_is_spoiled() -> None:
    outcome = run_campaign(CASES, SEED)
    assert outcome.cases.keys() == READERS.keys() and sum(outcome.cases.values()) >= CASES
    assert not outcome.faults, outcome.report()


@pytest.mark.parametrize(
    ("reader", "kind", "cases"),
    [("line", "line", 8), ("memory", "memory", 8), ("crash", "crash", 3), ("turning", "hang", 2), ("exception", "exception", 60)],
)
def test_a_campaign_finds_planted_faults_and_goes_on(reader: str, kind: str, cases: int) -> None:
    outcome = run_campaign(cases, 3, table="fuzz.planted:READERS", only=reader, seconds=0.5)
    spoiled = [number for number in range(cases) if make_case(reader, PLANTED[reader], 3, number).data != PLANTED[reader].samples[0]]
    found = [fault.number for fault in outcome.faults]
    assert {fault.kind for fault in outcome.faults} == {kind}
    assert sorted(found) == spoiled if kind != "exception" else 0 < len(found) <= len(spoiled)
    assert all(fault.mutations and f"--reader {reader} --seed 3 --case {fault.number}" in str(fault) for fault in outcome.faults)
    assert f"{cases} cases, {len(found)} faults" in outcome.report()


def test_a_case_that_sleeps_is_a_hang() -> None:
    (fault,) = run_campaign(1, 3, table="fuzz.planted:READERS", only="waiting", seconds=0.2).faults
    assert fault.kind == "hang"


def test_readers_without_fault_have_none() -> None:
    outcome = run_campaign(400, 5, table="fuzz.planted:SOUND")
    assert outcome.cases == {"sound": 200, "refusing": 200} and outcome.faults == ()


def test_cases_are_made_again_from_their_numbers_and_use_every_mutation() -> None:
    used: Counter[str] = Counter()
    for name, reader in READERS.items():
        cases = [make_case(name, reader, 1, number) for number in range(40)]
        assert cases[:3] == [make_case(name, reader, 1, number) for number in range(3)]
        assert sum(case.data not in reader.samples for case in cases) > 25, name
        used.update(mutation for case in cases for mutation in case.mutations)
    assert used.keys() == {*OF_TREES, *(mutation.__name__ for table in TABLES.values() for mutation in table)}
    assert {0, 1, 2**31, 2**63} < set(NUMBERS)
