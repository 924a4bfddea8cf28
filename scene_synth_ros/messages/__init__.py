"""Between our nouns and messages, and messages and bytes."""
