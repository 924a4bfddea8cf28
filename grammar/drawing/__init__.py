"""Top views and other drawings, as shapes and SVG."""
