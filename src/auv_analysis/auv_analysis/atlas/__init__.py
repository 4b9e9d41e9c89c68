"""How strongly the inertia of vehicles couples their degrees of freedom, without units."""
