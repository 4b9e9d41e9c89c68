"""The one place for topic names, QoS, frames, message <-> array, parameters and a node's life."""
