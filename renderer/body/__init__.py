"""What a moving body senses of itself: its inertial measurement unit, its wheels."""
