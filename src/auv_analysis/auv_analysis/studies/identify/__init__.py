"""From a recording to a model with its uncertainty: M, D and g of (1), lag, delay and gains.

The straight line: `Record` (measured motion and command) -> `Segment`s -> a start by linear least
squares -> `OutputError`, which refines it by simulating the segments -> covariance, what the data
cannot tell apart -> prediction of what was held out -> vehicle file, couplings, report.
"""
