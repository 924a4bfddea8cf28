"""The rooms of a run where no node runs: what they are sampled by, read once in a process, and each by its index."""

from dataclasses import replace
from functools import lru_cache
from pathlib import Path

from grammar.synthesize import SceneSynthesizer
from scene_description import SceneDescription
from scene_synth_ros.offline.settings import OfflineSettings
from scene_synth_ros.synthesize.catalogs import with_catalog
from scene_synth_ros.synthesize.room_schedule import times_of_room


@lru_cache(maxsize=1)
def _rules(grammar_file: str, catalog_dir: str) -> SceneSynthesizer:
    return with_catalog(SceneSynthesizer.from_config([Path(grammar_file)] if grammar_file else []), catalog_dir)


def rules_of(settings: OfflineSettings) -> SceneSynthesizer:
    """Return what the rooms of a run are sampled by.

    Raises:
        GrammarError: a file of it does not fit.
    """
    return _rules(settings.run.grammar_file, settings.run.catalog_dir)


def sample_room(rules: SceneSynthesizer, settings: OfflineSettings, index: int) -> SceneDescription:
    """Return a room of a run.

    Raises:
        SceneSynthError: it cannot be sampled.
    """
    rules = replace(rules, motion=settings.grammar["motion"])
    return rules.synthesize(settings.grammar["scene"], settings.run.seed, index, times_of_room(settings.run, index))
