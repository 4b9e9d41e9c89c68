"""Decomposition into generalised velocity components, control laws and set-points."""

from auv_gvc_controller.decomposition import decompose

__all__ = ['decompose']
