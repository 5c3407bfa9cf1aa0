"""Bodies that drive and collide."""
