"""A small valid bedroom made by hand, for tests: 4 x 3.5 m, door, window, bed, nightstand with a lamp on it, ceiling lamp, two poses."""

from __future__ import annotations

import math

from scene_description import (
    SCHEMA,
    CameraPose,
    Environment,
    Light,
    Material,
    ModelReference,
    Opening,
    ParseGraph,
    ParseNode,
    Part,
    Room,
    SceneDescription,
    SceneObject,
    Support,
    ValidityCheck,
    ValidityReport,
)
from scene_description.labels import LABEL_ID
from scene_description.poses import look_at

FLOOR = Support(kind="floor")
MATERIALS = (
    Material(id="oak", family="wood", base_color=(0.5, 0.34, 0.2), roughness=0.5),
    Material(id="paint", family="paint", base_color=(0.8, 0.78, 0.74)),
    Material(id="linen", family="fabric", base_color=(0.7, 0.7, 0.75), roughness=0.95),
    Material(id="brass", family="metal", base_color=(0.9, 0.7, 0.4), roughness=0.3, metallic=1.0),
    Material(id="glass", family="glass", base_color=(0.95, 0.97, 0.96), roughness=0.05, transmission=0.9),
)


def parts(**materials: str) -> tuple[Part, ...]:
    """Part name -> material id, as parts."""
    return tuple(Part(name=name, material=material) for name, material in materials.items())


def sample_room() -> Room:
    """The shell: a door that opens inwards in wall 0 (y = 0), a window in wall 2 (y = 3.5)."""
    door = Opening(
        id=1, category="door", label=LABEL_ID["door"], wall=0, offset_m=2.8, sill_m=0.0, width_m=0.9, height_m=2.0, hinge="end",
        model=ModelReference(generator="door", seed=3), parts=parts(leaf="paint", frame="paint", handle="brass"),
    )  # fmt: skip
    window = Opening(
        id=2, category="window", label=LABEL_ID["window"], wall=2, offset_m=1.2, sill_m=0.9, width_m=1.4, height_m=1.2,
        model=ModelReference(generator="window", seed=4), parts=parts(frame="paint", sill="paint", pane="glass", handle="brass"),
    )  # fmt: skip
    return Room(
        polygon_m=((0.0, 0.0), (4.0, 0.0), (4.0, 3.5), (0.0, 3.5)),
        height_m=2.6,
        wall_thickness_m=0.15,
        openings=(door, window),
        surfaces=parts(floor="oak", wall="paint", ceiling="paint", skirting="paint"),
    )


def sample_objects() -> tuple[SceneObject, ...]:
    """A bed along +x from wall 3, a nightstand beside it, a lamp on that and one under the ceiling."""
    bed = SceneObject(
        id=3, category="bed", label=LABEL_ID["bed"], size_m=(2.1, 1.6, 1.0), position_m=(1.1, 1.8, 0.0), yaw_rad=0.0, support=FLOOR,
        model=ModelReference(generator="bed", style="upholstered", seed=11),
        parts=parts(
            frame="oak", headboard="linen", legs="oak", mattress="linen", duvet="linen", sheet="linen", throw="oak", pillows="linen",
            cushion="oak", slats="oak",
        ),
    )  # fmt: skip
    nightstand = SceneObject(
        id=4, category="nightstand", label=LABEL_ID["night stand"], size_m=(0.45, 0.5, 0.55), position_m=(0.3, 2.9, 0.0), yaw_rad=0.0,
        support=FLOOR, group=3, model=ModelReference(generator="nightstand", seed=12),
        parts=parts(body="oak", drawers="oak", handles="brass", legs="oak"),
    )  # fmt: skip
    lamp = SceneObject(
        id=5, category="table_lamp", label=LABEL_ID["lamp"], size_m=(0.25, 0.25, 0.4), position_m=(0.25, 2.95, 0.55), yaw_rad=0.5,
        support=Support(kind="object", id=4), model=ModelReference(generator="table_lamp", seed=13),
        parts=parts(base="brass", stem="brass", shade="linen", bulb="linen"),
    )  # fmt: skip
    ceiling_lamp = SceneObject(
        id=6, category="ceiling_lamp", label=LABEL_ID["lamp"], size_m=(0.4, 0.4, 0.15), position_m=(2.0, 1.75, 2.45), yaw_rad=0.0,
        support=Support(kind="ceiling"), model=ModelReference(generator="ceiling_lamp", seed=14),
        parts=parts(mount="brass", shade="linen", bulb="linen"),
    )  # fmt: skip
    return (bed, nightstand, lamp, ceiling_lamp)


def sample_scene() -> SceneDescription:
    """The whole scene; it passes every check of ``scene_from_json``."""
    white = (1.0, 1.0, 1.0)
    eye = (3.5, 0.6, 1.5)
    targets = ((1.0, 2.0, 0.6), (0.8, 2.2, 0.6))
    return SceneDescription(
        schema=SCHEMA,
        id="sample-1",
        index=0,
        seed=7,
        category="bedroom",
        room=sample_room(),
        objects=sample_objects(),
        materials=MATERIALS,
        lights=(
            Light(object=5, part="shade", flux_lm=400.0, color_temperature_k=2700.0, color=(1.0, 0.42, 0.1)),
            Light(object=6, part="shade", flux_lm=2000.0, color_temperature_k=4000.0, color=white, on=False),
        ),
        environment=Environment(zenith=(900.0, 1000.0, 1300.0), horizon=(800.0, 800.0, 800.0), ground=(100.0, 100.0, 90.0)),
        camera_path=tuple(
            CameraPose(stamp_ns=k * 200_000_000, position_m=eye, orientation=look_at(eye, at)) for k, at in enumerate(targets)
        ),
        parse_graph=ParseGraph(
            nodes=(
                ParseNode(symbol="bedroom", kind="and"),
                ParseNode(symbol="bed", kind="terminal", parent=0, object=3),
                ParseNode(symbol="lamps", kind="set", parent=0, choice="1", log_probability=math.log(0.5)),
                ParseNode(symbol="lamp", kind="terminal", parent=2, object=5),
            ),
            log_probability=math.log(0.5),
            energies={"wall_distance": 0.25, "overlap": 0.0},
            weights={"wall_distance": 4.0, "overlap": 10.0},
            energy=1.0,
        ),
        validity=ValidityReport(valid=True, attempts=1, checks=(ValidityCheck(name="penetration_m", value=0.0, limit=0.001, passed=True),)),
    )
