"""The MCAP format: records, chunks, files."""
