"""The report of a diagnosis: tables, figures, page, folder."""
