"""Simulation: records of a spacecraft whose true attitude is known, from models and bounded sensors."""
