"""The controller without ROS: settings, sampled law, set-points, watchdogs, output stage."""
