"""Small things: what stands and lies on furniture beyond what the grammar itself puts there, by counts and by the clutter asked for."""
