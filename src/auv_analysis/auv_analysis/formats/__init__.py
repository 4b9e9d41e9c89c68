"""Vehicle parameters from and to other systems: uuv_simulator, Gazebo, lists of derivatives."""
