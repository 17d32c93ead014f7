"""Estimators: what runs over a record, built on the certified attitude and the generated functions."""
