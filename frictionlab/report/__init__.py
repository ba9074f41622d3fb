"""A campaign as one HTML page, and a page for each of its tests."""

from frictionlab.report.page import page, write_report

__all__ = ["page", "write_report"]
