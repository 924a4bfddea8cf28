"""What the rooms of a run are sampled by, where no node runs; read once in a process."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path

from grammar.synthesize import SceneSynthesizer
from scene_synth_ros.offline.settings import OfflineSettings
from scene_synth_ros.synthesize.catalogs import with_catalog


@lru_cache(maxsize=1)
def _rules(grammar_file: str, catalog_dir: str) -> SceneSynthesizer:
    return with_catalog(SceneSynthesizer.from_config([Path(grammar_file)] if grammar_file else []), catalog_dir)


def rules_of(settings: OfflineSettings) -> SceneSynthesizer:
    """Return what the rooms of a run are sampled by.

    Raises:
        GrammarError: a file of it does not fit.
    """
    return _rules(settings.run.grammar_file, settings.run.catalog_dir)
