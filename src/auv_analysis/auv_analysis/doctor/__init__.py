"""What is wrong with the set-up: it must run where packages are broken, so checks import late."""
