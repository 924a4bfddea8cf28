"""Pictures that commands draw: sheets of many, drawings as PNG, the studio of the gallery."""
