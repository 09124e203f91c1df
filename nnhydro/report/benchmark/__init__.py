"""The report of a benchmark: tables, figures, page, folder."""
