"""Looks of surfaces with a base colour of 1, by fields of the lanes: none may lose or gain light."""

WHITE: dict[str, dict[str, float]] = {
    "lambert": {"IOR": 1.0},
    "gloss": {},
    "lacquer": {"ROUGHNESS": 0.1},
    "mirror": {"METALLIC": 1.0, "ROUGHNESS": 0.0},
    "steel": {"METALLIC": 1.0, "ROUGHNESS": 0.3},
    "rough metal": {"METALLIC": 1.0, "ROUGHNESS": 1.0},
    "half metal": {"METALLIC": 0.5, "ROUGHNESS": 0.6},
    "coated": {"COAT": 1.0},
    "coated metal": {"COAT": 1.0, "METALLIC": 1.0, "ROUGHNESS": 0.7},
    "cloth": {"SHEEN": 1.0, "ROUGHNESS": 0.9},
    "glass": {"TRANSMISSION": 1.0, "ROUGHNESS": 0.0},
    "frosted": {"TRANSMISSION": 1.0, "ROUGHNESS": 0.4},
    "rough glass": {"TRANSMISSION": 1.0, "ROUGHNESS": 0.8},
    "inside glass": {"TRANSMISSION": 1.0, "ROUGHNESS": 0.0, "COS_FRONT": -1.0},
    "inside frosted": {"TRANSMISSION": 1.0, "ROUGHNESS": 0.4, "COS_FRONT": -1.0},
    "milky glass": {"TRANSMISSION": 0.5},
}
