"""Which recordings are fitted and which held out: one protocol a file."""
