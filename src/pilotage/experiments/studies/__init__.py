"""Studies: a mission times settings times seeds, run so that no finished trial is ever lost."""
