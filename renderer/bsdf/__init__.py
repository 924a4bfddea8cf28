"""How surfaces scatter light: microfacets, their albedos, and the layered model."""
