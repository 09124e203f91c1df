"""Files of recordings, one format a file; `files.py` knows which reader takes which file."""
