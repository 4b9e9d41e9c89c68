"""Former place of what tables share, for the studies that have not moved to `results` yet."""
