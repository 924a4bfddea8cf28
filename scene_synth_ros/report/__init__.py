"""A report of one or more evaluations as one HTML page: what reacts to which factor, how much, and where an algorithm fails."""
