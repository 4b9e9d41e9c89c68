"""Output of commands: results folders, new files, progress on a terminal."""
