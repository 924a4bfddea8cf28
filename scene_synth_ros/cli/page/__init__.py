"""A bag as one HTML page: what is taken from the bag, how pixels are kept in the page, and the page's own files in ``web``."""
