"""Files to start from: shipped numbers with what the schemas say of each key."""
