"""Contacts that yield before they slip, solved exactly: Jenkins's slider and Iwan's many (README of this folder)."""

from frictionlab.simulator.elastic.sliders import iwan_sliders, sliders_of
from frictionlab.simulator.elastic.solve import ElasticMotion, last, run, steady, steady_from

__all__ = ["ElasticMotion", "iwan_sliders", "last", "run", "sliders_of", "steady", "steady_from"]
