"""What may be asked for: grammars and categories as files, their checks, requests."""
