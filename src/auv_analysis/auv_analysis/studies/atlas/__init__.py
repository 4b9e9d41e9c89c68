"""Atlas: couplings by inertia of several vehicles, without units."""
