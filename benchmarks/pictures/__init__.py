"""Pictures of unseen rooms beside photographs: what statistics tell of them, and what their views show."""
