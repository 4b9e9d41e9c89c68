"""The paper's procedure, steps 1 to 6, as one study of a scenario."""
