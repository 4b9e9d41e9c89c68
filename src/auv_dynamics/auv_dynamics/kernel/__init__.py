"""The kernel: integrator, six-vectors, lanes, compilation; `simd` is optional."""
