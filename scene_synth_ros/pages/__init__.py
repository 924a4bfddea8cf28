"""Pages that are one HTML file each: style, script and contents in it, nothing loaded; ``web`` has what all of them share."""
