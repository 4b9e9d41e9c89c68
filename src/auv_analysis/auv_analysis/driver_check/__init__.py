"""Whether a vehicle driver offers what the controller, the recorder and the analysis need."""
