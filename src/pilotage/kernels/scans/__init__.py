"""What range sensors read, and what a scan says."""
