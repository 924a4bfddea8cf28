"""Pictures by the light of an irradiance cache."""
