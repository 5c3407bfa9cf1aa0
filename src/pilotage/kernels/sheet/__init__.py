"""The small robot on its sheet: factors of its smoother, room, cells."""
