"""Measurement logs in and out."""
