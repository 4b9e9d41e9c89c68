"""Checks of the set-up; they must run where packages are broken, and so import late."""
