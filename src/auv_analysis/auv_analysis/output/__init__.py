"""What commands leave and show: results folders, new files, progress on a terminal."""
