"""Doors to other ecosystems; nothing inside knows them, and each needs an extra."""
