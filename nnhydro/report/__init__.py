"""For people: tables, figures and pages of results; the only folder that imports matplotlib."""
