"""The rules of appearance given a request: with the styles and the palette that it asks for, without the materials that it excludes."""

from collections.abc import Collection, Mapping
from dataclasses import replace

from grammar.appearance.appearance_rules import Appearance, CategoryLook, Families, HueOdds, can_draw_materials, check_appearance
from grammar.appearance.looks import ANY, ROOM, TargetedLook, read_looks
from grammar.spec.request import RequestError, SceneRequest
from scene_description import FieldError


def restricted(
    appearance: Appearance,
    request: SceneRequest,
    needed: Collection[str] = (),
    more_parts: Mapping[str, Collection[str]] | None = None,
) -> Appearance:
    """Return the rules of appearance given a request, whose looks are checked first.

    Styles that need excluded materials are not drawn.  ``needed``: categories that the room may hold; ``more_parts``: category -> parts of
    models of the user's catalogue.

    Raises:
        RequestError: a category, part, style, material or family is unknown, or nothing is left to draw from.
    """
    looks = read_looks(request.looks)
    for targeted in looks:
        _check_look(targeted, appearance, request.exclude_materials, more_parts or {})
    # leave out excluded materials, and the styles that need them
    excluded = ", ".join(request.exclude_materials)
    changed = _without_materials(appearance, request.exclude_materials, request.room_type) if excluded else appearance
    # keep the styles that are asked for
    categories = dict(changed.categories)
    for targeted in looks:
        if targeted.look.styles and targeted.owner in categories:
            categories[targeted.owner] = _with_styles(categories[targeted.owner], targeted)
    for category in needed:
        if category not in categories or not categories[category].styles:
            raise RequestError(f"exclude_materials: {excluded}: expected materials to be left for a style of {category}, got none")
    # fix the palette
    palette = changed.palette
    if request.palette_hue_deg >= 0.0:
        palette = replace(palette, hues_deg=(HueOdds(hue=request.palette_hue_deg, odds=1.0),), jitter_deg=0.0)
    changed = replace(changed, categories=categories, palette=palette)
    try:
        check_appearance(changed)
    except FieldError as error:
        raise RequestError(f"exclude_materials: {excluded}: expected materials to be left for every part, got none ({error})") from None
    return changed


def _check_look(
    targeted: TargetedLook, appearance: Appearance, excluded: Collection[str], more_parts: Mapping[str, Collection[str]]
) -> None:
    """Check that the target of a look exists, and the styles, the material and the family that it names."""
    where, look = f"looks: {targeted.text!r}", targeted.look
    _check_target(where, targeted, appearance, more_parts)
    if look.styles:
        if targeted.owner not in appearance.categories or targeted.part != ANY:
            raise RequestError(f"{where}: expected styles of a category, got the target '{targeted.owner}/{targeted.part}'")
        styles = set(appearance.categories[targeted.owner].styles)
        if not set(look.styles) <= styles:
            raise RequestError(f"{where}: expected styles among {', '.join(sorted(styles))}, got {', '.join(look.styles)}")
    for name, value, known in (("material", look.material, set(appearance.materials)), ("family", look.family, set(appearance.families))):
        if value is not None and value not in known:
            raise RequestError(f"{where}: expected a {name} of materials.yaml ({', '.join(sorted(known))}), got '{value}'")
        family = appearance.materials[value].family if name == "material" and value is not None else value
        if value is not None and (value in excluded or family in excluded):
            raise RequestError(f"{where}: expected a {name} that exclude_materials leaves, got '{value}'")


def _check_target(where: str, targeted: TargetedLook, appearance: Appearance, more_parts: Mapping[str, Collection[str]]) -> None:
    if targeted.owner.isdigit():
        return
    parts = {name: set(rule.parts) | set(more_parts.get(name, ())) for name, rule in appearance.categories.items()}
    parts[ROOM] = set(appearance.surfaces)
    known = set().union(*parts.values()) if targeted.owner == ANY else parts.get(targeted.owner)
    if known is None:
        raise RequestError(f"{where}: expected an id, *, room or a category ({', '.join(sorted(appearance.categories))})")
    if targeted.part != ANY and targeted.part not in known:
        raise RequestError(f"{where}: expected a part of {targeted.owner} ({', '.join(sorted(known))}), got '{targeted.part}'")


def _with_styles(rule: CategoryLook, targeted: TargetedLook) -> CategoryLook:
    """Return a category's look with the styles that are asked for only."""
    kept = {name: style for name, style in rule.styles.items() if name in targeted.look.styles}
    if not kept:
        raise RequestError(f"looks: {targeted.text!r}: expected a style that exclude_materials leaves ({', '.join(rule.styles)})")
    if not sum(style.odds for style in kept.values()) > 0.0:
        kept = {name: replace(style, odds=1.0) for name, style in kept.items()}
    return replace(rule, styles=kept, suite=None)


def _without_materials(appearance: Appearance, excluded: Collection[str], room_type: str) -> Appearance:
    """Return the rules of appearance, for one room type, without materials and families by name."""
    unknown = sorted(set(excluded) - set(appearance.materials) - set(appearance.families))
    if unknown:
        raise RequestError(
            f"exclude_materials: expected names of materials or families ({', '.join(sorted(appearance.families))}), got '{unknown[0]}'"
        )
    materials = {name: kind for name, kind in appearance.materials.items() if name not in excluded and kind.family not in excluded}
    families = {family: kept for family, names in appearance.families.items() if (kept := tuple(n for n in names if n in materials))}

    def left(odds: Families) -> Families:
        return {family: value for family, value in odds.items() if family in families}

    categories = {}
    for name, look in appearance.categories.items():
        parts = {
            part: replace(rule, families=left(rule.families), by_style={style: left(odds) for style, odds in rule.by_style.items()})
            for part, rule in look.parts.items()
        }
        reduced = replace(look, parts=parts)
        styles = {style: rule for style, rule in look.styles.items() if can_draw_materials(reduced, style, families)}
        if sum(rule.odds for rule in styles.values()) > 0.0:
            categories[name] = replace(reduced, styles=styles)
    surfaces = {
        name: replace(
            rule, families=left(rule.families), by_room={room: left(odds) for room, odds in rule.by_room.items() if room == room_type}
        )
        for name, rule in appearance.surfaces.items()
    }
    palette = replace(appearance.palette, kept={family: n for family, n in appearance.palette.kept.items() if family in families})
    return replace(appearance, materials=materials, families=families, palette=palette, surfaces=surfaces, categories=categories)
