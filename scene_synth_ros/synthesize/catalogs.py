"""Brings the user's catalogue to the grammar: reads its file, measures its models, says what is wrong with them."""

from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

from grammar import GrammarError
from grammar.catalog import entry_faults, read_catalog
from grammar.synthesize import SceneSynthesizer
from renderer.core.errors import MeshFileError
from scene_description.catalog import Catalog, CatalogEntry, CatalogModel, CatalogSurface

SIZE_SLACK = 1.25
"""How far beyond the grammars' bounds a size may lie before it is called implausible."""


class Finding(NamedTuple):
    """What was found about a model file; errors keep it from being used."""

    file: str
    error: bool
    text: str


def with_catalog(synthesizer: SceneSynthesizer, folder: str) -> SceneSynthesizer:
    """Return a synthesizer that also takes the models of a folder; of no folder (empty), the same one.

    Raises:
        GrammarError: the folder is missing, or an entry of its list cannot be used; one line.
        MeshFileError: a model cannot be used; one line.
    """
    if not folder:
        return synthesizer
    from renderer.files.catalog_models import measure_model  # a tenth of a grammar node's start, and few have a catalogue

    root = Path(folder)
    if not root.is_dir():
        raise GrammarError(f"catalog_dir: expected a folder, got '{folder}'")
    listed = read_catalog(root)
    models = []
    for entry in listed.models:
        faults = entry_faults(entry, synthesizer.appearance)
        if faults:
            raise GrammarError(f"{root}: {entry.file}: {faults[0]}")
        models.append(measure_model(root, entry))
    return synthesizer.with_catalog(Catalog(models=tuple(models), procedural=listed.procedural))


def check_catalog(synthesizer: SceneSynthesizer, root: Path) -> list[Finding]:
    """Look at every model of a catalogue.

    Raises:
        GrammarError: ``catalog.yaml`` itself cannot be read.
    """
    from renderer.files.catalog_models import check_model, measure_model

    listed = read_catalog(root)
    ranges = category_sizes(synthesizer)
    findings = [
        Finding("catalog.yaml", True, f"procedural.{name}: expected a known category")
        for name in listed.procedural
        if name not in synthesizer.appearance.categories
    ]
    for entry in listed.models:
        faults = entry_faults(entry, synthesizer.appearance)
        findings += [Finding(entry.file, True, text) for text in faults]
        try:
            model = measure_model(root, entry)
            if not faults:
                findings += [Finding(entry.file, True, text) for text in entry_faults(entry, synthesizer.appearance, tuple(model.parts))]
            findings += [Finding(entry.file, False, text) for text in check_model(root, entry, _tops(synthesizer, entry))]
        except MeshFileError as error:
            findings.append(Finding(entry.file, True, str(error)))
            continue
        findings += [Finding(entry.file, False, text) for text in (*_size_faults(model, ranges), *_entry_hints(model))]
    return findings


def category_sizes(synthesizer: SceneSynthesizer) -> dict[str, tuple[tuple[float, ...], tuple[float, ...]]]:
    """Return category -> least and greatest depth, width and height over all room types."""
    ranges: dict[str, tuple[tuple[float, ...], tuple[float, ...]]] = {}
    for grammar in synthesizer.grammars.values():
        for rule in grammar.objects.values():
            low, high = ranges.get(rule.category, (rule.low_m, rule.high_m))
            ranges[rule.category] = (tuple(map(min, low, rule.low_m)), tuple(map(max, high, rule.high_m)))
    return ranges


def _size_faults(model: CatalogModel, ranges: Mapping[str, tuple[tuple[float, ...], tuple[float, ...]]]) -> list[str]:
    if model.entry.category not in ranges:
        return []
    low, high = ranges[model.entry.category]
    own = " x ".join(f"{side:.3g}" for side in model.size_m)
    usual = " x ".join(f"{a:.2g}-{b:.2g}" for a, b in zip(low, high, strict=True))
    if model.entry.scale == "fixed":
        odd = [not a / SIZE_SLACK <= side <= b * SIZE_SLACK for side, a, b in zip(model.size_m, low, high, strict=True)]
        reason = "its own size is implausible; check unit_m, front and up"
    else:  # stretched or scaled: only the proportions count
        middle = [side / (0.5 * (a + b)) for side, a, b in zip(model.size_m, low, high, strict=True)]
        odd = [max(middle) / min(middle) > 3.0]
        reason = "its proportions are implausible; check front and up"
    return [f"{reason}: {own} m, {model.entry.category} has {usual} m (depth x width x height)"] if any(odd) else []


def _entry_hints(model: CatalogModel) -> list[str]:
    entry = model.entry
    hints = []
    if entry.front is None:
        hints.append("front is not stated: +z is taken for glTF, +x for others")
    lost = [name for name in entry.rename.values() if name not in model.parts]
    if lost:
        hints.append(f"rename: no part became {', '.join(sorted(set(lost)))}; the model has {', '.join(model.parts)}")
    return hints


def _tops(synthesizer: SceneSynthesizer, entry: CatalogEntry) -> tuple[CatalogSurface, ...]:
    if entry.surfaces is not None:
        return entry.surfaces
    category = synthesizer.categories.get(entry.category)
    tops = () if category is None else category.surfaces
    return tuple(CatalogSurface(height_fraction=top.height_fraction, height_m=max(top.height_m, 0.0), inset_m=top.inset_m) for top in tops)
