"""Running missions on a sheet."""
