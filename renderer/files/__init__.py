"""The user's own files: models, images, and what is wrong with them."""
