"""Moved to nnhydro.report.screen."""

from nnhydro.report.screen import JSON, emit, note, say, table

__all__ = ["JSON", "emit", "note", "say", "table"]
