"""A typical size (depth, width, height) in metres of every model, and sizes round it."""

import numpy as np

from grammar.small_things.rules import read_small_things
from grammar.spec.categories import read_categories
from scene_description.share import config_path

_THINGS = read_small_things(config_path("small_things.yaml"), read_categories(config_path("categories.yaml"))).things

_FURNITURE = {
    "bed": (2.1, 1.7, 1.05),
    "nightstand": (0.42, 0.5, 0.52),
    "dresser": (0.48, 1.3, 0.85),
    "wardrobe": (0.6, 1.6, 2.1),
    "desk": (0.65, 1.3, 0.75),
    "desk_chair": (0.62, 0.62, 0.98),
    "bookshelf": (0.32, 0.95, 1.9),
    "armchair": (0.85, 0.82, 0.85),
    "toilet": (0.66, 0.38, 0.8),
    "bathtub": (0.75, 1.68, 0.57),
    "shower_cabin": (0.9, 0.9, 2.0),
    "washbasin": (0.48, 0.72, 0.86),
    "washing_machine": (0.6, 0.6, 0.85),
    "bathroom_cabinet": (0.16, 0.6, 0.7),
    "towel_rail": (0.1, 0.6, 0.55),
    "bath_mat": (0.5, 0.8, 0.02),
    "laundry_basket": (0.35, 0.45, 0.6),
    "soap_dispenser": (0.08, 0.07, 0.18),
    "toilet_paper_holder": (0.1, 0.15, 0.12),
    "toothbrush_cup": (0.08, 0.08, 0.19),
    "filing_cabinet": (0.6, 0.45, 1.3),
    "whiteboard": (0.03, 1.5, 1.0),
    "printer": (0.42, 0.44, 0.3),
    "desk_lamp": (0.22, 0.18, 0.44),
    "pen_holder": (0.09, 0.09, 0.19),
    "paper_tray": (0.33, 0.25, 0.12),
    "globe": (0.3, 0.3, 0.4),
    "treadmill": (1.8, 0.85, 1.4),
    "exercise_bike": (1.1, 0.55, 1.25),
    "weight_bench": (1.25, 0.55, 0.5),
    "dumbbell_rack": (0.55, 1.3, 0.9),
    "exercise_mat": (1.82, 0.62, 0.01),
    "gym_ball": (0.65, 0.65, 0.65),
    "kettlebell": (0.19, 0.19, 0.28),
    "workbench": (0.7, 1.6, 0.9),
    "tool_cabinet": (0.46, 0.7, 0.95),
    "storage_shelf": (0.45, 1.0, 1.85),
    "other_furniture": (0.5, 0.8, 0.9),
    "other_prop": (0.2, 0.2, 0.2),
    "cardboard_box": (0.4, 0.5, 0.36),
    "plastic_crate": (0.4, 0.6, 0.32),
    "bicycle": (1.75, 0.58, 1.05),
    "car": (4.2, 2.0, 1.48),
    "step_ladder": (0.75, 0.48, 1.3),
    "paint_can": (0.18, 0.18, 0.2),
    "toolbox": (0.24, 0.48, 0.27),
    "suitcase": (0.28, 0.45, 0.75),
    "pouf": (0.5, 0.5, 0.42),
    "floor_lamp": (0.45, 0.45, 1.6),
    "potted_plant": (0.5, 0.5, 1.1),
    "rug": (1.6, 2.3, 0.015),
    "waste_bin": (0.28, 0.28, 0.35),
    "table_lamp": (0.3, 0.3, 0.5),
    "alarm_clock": (0.07, 0.14, 0.12),
    "book_stack": (0.16, 0.22, 0.1),
    "shoes": (0.29, 0.24, 0.11),
    "clothes": (0.42, 0.5, 0.14),
    "papers": (0.3, 0.24, 0.012),
    "remote_control": (0.19, 0.05, 0.022),
    "laptop": (0.3, 0.34, 0.23),
    "monitor": (0.2, 0.55, 0.45),
    "keyboard": (0.14, 0.44, 0.03),
    "mug": (0.12, 0.085, 0.1),
    "vase": (0.14, 0.14, 0.3),
    "television": (0.25, 1.1, 0.68),
    "picture": (0.03, 0.7, 0.5),
    "wall_mirror": (0.03, 0.6, 0.9),
    "radiator": (0.1, 1.0, 0.6),
    "ceiling_lamp": (0.42, 0.42, 0.3),
    # living room
    "sofa": (0.92, 2.1, 0.85),
    "corner_sofa": (1.65, 2.6, 0.85),
    "coffee_table": (0.6, 1.1, 0.42),
    "tv_stand": (0.42, 1.6, 0.5),
    "side_table": (0.45, 0.45, 0.55),
    "sideboard": (0.45, 1.6, 0.8),
    "speaker": (0.25, 0.2, 0.9),
    "game_console": (0.26, 0.1, 0.39),
    "candle": (0.09, 0.09, 0.14),
    "photo_frame": (0.1, 0.16, 0.2),
    "bowl": (0.26, 0.26, 0.1),
    "wall_clock": (0.04, 0.32, 0.32),
    "wall_shelf": (0.22, 0.8, 0.2),
    "window_sill": (0.2, 1.4, 0.03),
    "curtain": (0.1, 2.2, 2.3),
    # dining
    "dining_table": (0.9, 1.7, 0.75),
    "dining_chair": (0.52, 0.46, 0.9),
    "plate": (0.26, 0.26, 0.025),
    "drinking_glass": (0.08, 0.08, 0.16),
    "fruit_bowl": (0.3, 0.3, 0.18),
    "china_cabinet": (0.42, 1.0, 1.95),
    "wine_bottle": (0.078, 0.078, 0.31),
    # kitchen
    "kitchen_counter": (0.62, 1.2, 0.9),
    "sink_counter": (0.62, 1.0, 1.14),
    "stove": (0.62, 0.6, 0.9),
    "dishwasher": (0.62, 0.6, 0.9),
    "refrigerator": (0.68, 0.65, 1.85),
    "wall_cabinet": (0.35, 0.9, 0.7),
    "kitchen_corner": (0.62, 0.62, 0.9),
    "corner_wall_cabinet": (0.62, 0.62, 0.7),
    "oven_tower": (0.62, 0.6, 2.1),
    "larder": (0.62, 0.6, 2.1),
    "peninsula_corner": (0.62, 0.62, 0.9),
    "island_counter": (0.92, 0.8, 0.9),
    "built_in_washer": (0.62, 0.62, 0.9),
    "range_hood": (0.48, 0.6, 0.7),
    "microwave": (0.38, 0.5, 0.29),
    "toaster": (0.19, 0.32, 0.2),
    "kettle": (0.17, 0.23, 0.24),
    "coffee_maker": (0.28, 0.22, 0.34),
    "cooking_pot": (0.24, 0.33, 0.2),
    "knife_block": (0.2, 0.12, 0.33),
    "cutting_board": (0.26, 0.4, 0.035),
    "bar_stool": (0.42, 0.42, 0.85),
    "stool": (0.33, 0.33, 0.45),
    # hallway
    "coat_rack": (0.5, 0.5, 1.75),
    "wall_hooks": (0.09, 0.7, 0.18),
    "shoe_rack": (0.32, 0.8, 0.55),
    "console_table": (0.35, 1.1, 0.8),
    "umbrella_stand": (0.24, 0.24, 0.8),
    "bench": (0.4, 1.2, 0.46),
    "light_switch": (0.014, 0.085, 0.085),
}

SIZES = {name: thing.size_m for name, thing in _THINGS.items()} | _FURNITURE
_ORDER = [*sorted(_FURNITURE), *sorted(set(SIZES) - set(_FURNITURE))]
"""Numbers the models' random cases; new small things change none of the others'."""


def sizes_of(generator: str) -> list[tuple[float, float, float]]:
    """Return the typical size of a model, a smaller, a larger and three uneven ones."""
    rng = np.random.default_rng(_ORDER.index(generator))
    nominal = np.array(SIZES[generator])
    shapes = [nominal, 0.72 * nominal, 1.3 * nominal, *(nominal * rng.uniform(0.75, 1.25, (3, 3)))]
    return [(float(d), float(w), float(h)) for d, w, h in shapes]


def random_cases(
    generator: str, styles: tuple[str, ...], count: int = 20, spread: float = 0.22
) -> list[tuple[str, int, tuple[float, float, float]]]:
    """Return ``count`` random (style, seed, size) of a model; every style comes up."""
    rng = np.random.default_rng([_ORDER.index(generator), count])
    sizes = np.array(SIZES[generator]) * rng.uniform(1.0 - spread, 1.0 + spread, (count, 3))
    return [(styles[k % len(styles)], int(rng.integers(2**31)), (float(d), float(w), float(h))) for k, (d, w, h) in enumerate(sizes)]
