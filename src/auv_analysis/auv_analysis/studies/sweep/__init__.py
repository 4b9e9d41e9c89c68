"""Sweeps: campaign -> values of each rollout -> blocks on an executor -> Parquet."""
