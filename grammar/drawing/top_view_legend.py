"""The legend of a top view: functional groups and their colours, numbered objects, signs."""

from __future__ import annotations

from collections.abc import Sequence

from grammar.drawing.shapes import Point, area, dot, line, words
from grammar.drawing.top_view_labels import Label
from grammar.drawing.top_view_plan import DOOR, FONT_SIZE, INK, LINE_HEIGHT, PATH, SLOPE, SLOPE_LINES_M, TITLE, Plan
from scene_description import SceneDescription

_GROUP_COLORS = ("#c0392b", "#1f6fb4", "#2a8f45", "#8e44ad", "#d2791a", "#0f8b8d", "#b5338a", "#6b6f1d")


def _roots(scene: SceneDescription) -> dict[int, int]:
    """Return for every object of a functional group the id of the group's outermost core, an object or an opening."""
    core = {item.id: item.group for item in scene.objects}
    roots = {}
    for item in scene.objects:
        root = item.id
        while (above := core.get(root)) is not None:
            root = above
        roots[item.id] = root
    gathered = {root for key, root in roots.items() if key != root}
    return {key: root for key, root in roots.items() if root in gathered}


def group_colors(scene: SceneDescription) -> dict[int, str]:
    """Return object id -> colour of its functional group, for objects of groups."""
    roots = _roots(scene)
    order = {root: k for k, root in enumerate(sorted(set(roots.values())))}
    return {key: _GROUP_COLORS[order[root] % len(_GROUP_COLORS)] for key, root in roots.items()}


def draw_legend(plan: Plan, scene: SceneDescription, color: dict[int, str], labels: Sequence[Label]) -> float:
    """Draw groups, numbers and signs to the right of the plan; return the y of the last line in pixels."""
    x, y = plan.width + 4.0, TITLE + 10.0
    name = {item.id: item.category.replace("_", " ") for item in scene.objects} | {
        opening.id: opening.category for opening in scene.room.openings
    }
    rows = _group_rows(scene, name, color)
    if rows:
        plan.shapes.append(words((x, y), "groups", FONT_SIZE, fill="#666666", anchor="start"))
    for shown, text in rows:
        y += LINE_HEIGHT
        if shown:
            plan.shapes.append(area([(x + 1, y - 5), (x + 11, y - 5), (x + 11, y + 5), (x + 1, y + 5)], "#ffffff", stroke=shown, width=2.2))
        plan.shapes.append(words((x + 18, y), text, FONT_SIZE, anchor="start"))
    numbered = [f"{label.text} {name[label.object_id]}" for label in labels if label.numbered]
    if numbered:
        y += 1.6 * LINE_HEIGHT
        plan.shapes.append(words((x, y), "numbers", FONT_SIZE, fill="#666666", anchor="start"))
    for text in numbered:
        y += LINE_HEIGHT
        plan.shapes.append(words((x, y), text, FONT_SIZE, anchor="start"))
    return _draw_signs(plan, x, y + 1.6 * LINE_HEIGHT, sloped=scene.room.slopes is not None)


def _group_rows(scene: SceneDescription, name: dict[int, str], color: dict[int, str]) -> list[tuple[str, str]]:
    """Return the lines of the legend about functional groups: the group's colour, empty from the second line on, and the text."""
    roots = _roots(scene)
    rows: list[tuple[str, str]] = []
    for root in sorted(set(roots.values())):
        members = [name[key] for key in sorted(roots) if roots[key] == root and key != root]
        shown = next(color[key] for key in roots if roots[key] == root)
        lines = _wrap(f"{name[root]}: {', '.join(members)}", 34)
        rows.extend((shown if k == 0 else "", text) for k, text in enumerate(lines))
    return rows


def _draw_signs(plan: Plan, x: float, y: float, *, sloped: bool) -> float:
    plan.shapes.append(words((x, y), "signs", FONT_SIZE, fill="#666666", anchor="start"))
    front = area([(x + 11, y + 16), (x + 2, y + 11), (x + 2, y + 21)], INK, opacity=0.75)
    pale = area(_square(x, y + 27), "#dddddd", stroke=INK, width=0.7)
    hangs = line([*_square(x, y + 43), (x, y + 43)], INK, 1.0, (4.0, 3.0))
    door = line([(x, y + 64), (x + 12, y + 64)], DOOR, 3.0)
    path = (line([(x, y + 80), (x + 12, y + 80)], PATH, 2.0), dot((x, y + 80), 4.0, PATH))
    slope = line([(x, y + 96), (x + 14, y + 96)], SLOPE, 1.6, (5.0, 3.0))
    signs = [
        ((front,), "front"),
        ((pale,), "paler: stands on something"),
        ((hangs,), "hangs from the ceiling"),
        ((door,), "door leaf, open"),
        (path, "camera's path from its start"),
        *([((slope,), f"ceiling {' and '.join(f'{height:g}' for height in SLOPE_LINES_M)} m high")] if sloped else []),
    ]
    for shapes, text in signs:
        y += LINE_HEIGHT
        plan.shapes.extend(shapes)
        plan.shapes.append(words((x + 18, y), text, FONT_SIZE, anchor="start"))
    return y


def _square(x: float, y: float) -> list[Point]:
    return [(x, y), (x + 12, y), (x + 12, y + 10), (x, y + 10)]


def _wrap(text: str, most: int) -> list[str]:
    lines = [""]
    for word in text.split(" "):
        if lines[-1] and len(lines[-1]) + 1 + len(word) > most:
            lines.append("")
        lines[-1] = f"{lines[-1]} {word}".strip()
    return lines
