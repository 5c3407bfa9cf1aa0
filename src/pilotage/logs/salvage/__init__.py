"""What can still be read of a damaged bag: its records are walked from the beginning until they end."""
