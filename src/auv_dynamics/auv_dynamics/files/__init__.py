"""Files in and errors out: YAML and JSON by schema, nearest names, an end in good order."""
